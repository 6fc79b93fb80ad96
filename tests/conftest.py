"""What every process of a test run needs.

A run that was started in the background ignores Ctrl-C, and so would every program that a test
starts to interrupt it. Several tests run at a time: threads of a BLAS that wait for a processor
would take it from the others.
"""

from __future__ import annotations

import os
import signal

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
