"""The name of 0.1 of `flexura.signals`."""

import warnings

from .signals import *  # noqa: F403

warnings.warn("flexura.signal is now flexura.signals", DeprecationWarning, stacklevel=2)
