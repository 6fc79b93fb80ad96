"""The name of 0.1 of `flexura.signals.shaping`."""

import warnings

from .signals.shaping import *  # noqa: F403

warnings.warn("flexura.shaping is now flexura.signals.shaping", DeprecationWarning, stacklevel=2)
