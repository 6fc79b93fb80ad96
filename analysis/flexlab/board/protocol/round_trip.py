"""How long an answer takes, and when a command without one is to be repeated.

Mean and deviation of the round trip as in TCP (Jacobson and Karels 1988; RFC 6298): with a sample
R, the deviation D and the mean S become

    D = 3/4 D + 1/4 |S - R|,    S = 7/8 S + 1/8 R,    repeat after S + 4 D

and D = R / 2, S = R with the first one. A sample is a command that was sent once (Karn), or one
whose answer came twice: then it was repeated too early, and its first answer tells how long it
takes.
"""

from __future__ import annotations

LEAST_S = 0.004  # above S: the host looks once in a millisecond, the board sends reports between


class RoundTrip:
    """Measured times from a command to its answer [s]."""

    def __init__(self, unmeasured_s: float) -> None:
        self.unmeasured_s = unmeasured_s
        self.mean_s: float | None = None
        self._deviation_s = 0.0

    def measured(self, seconds: float) -> None:
        """Take a sample."""
        if self.mean_s is None:
            self.mean_s, self._deviation_s = seconds, seconds / 2
            return
        self._deviation_s += 0.25 * (abs(self.mean_s - seconds) - self._deviation_s)
        self.mean_s += 0.125 * (seconds - self.mean_s)

    @property
    def repeat_s(self) -> float:
        """After how long without an answer a command is sent again; the first measurement makes it
        the line's own."""
        if self.mean_s is None:
            return self.unmeasured_s
        return min(self.mean_s + max(4 * self._deviation_s, LEAST_S), self.unmeasured_s)
