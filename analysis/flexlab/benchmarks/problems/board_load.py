"""Processor load of the emulated board under its hardest motion, as rows for a table."""

from __future__ import annotations

from ...board.emulator.simulator import CLOCK_HZ
from ...experiment.flash import RIG, build
from ...rig import load as load_rig
from . import firmware_load


def measure() -> list[tuple[str, str, float]]:
    """Measure the load of the board's processor under its hardest motion, emulated.

    Returns:
        Rows (what, value in words, number in SI units).
    """
    elf, rig = build(), load_rig(RIG)
    found, most = firmware_load.measure(elf, rig), firmware_load.measure(elf, rig, every_term=True)
    fast, alone = sorted(
        (firmware_load.experiment(elf, rig) for _ in range(3)), key=lambda both: both[0] / both[1]
    )[1]
    period, longest, every = CLOCK_HZ / 1000, found.control_longest, most.control_longest
    jitter = max(found.period_most - period, period - found.period_least)

    def us(cycles: float) -> str:
        return f"{1e6 * cycles / CLOCK_HZ:.1f} us"

    return [
        (
            "encoder edges at the peak, missed",
            f"{found.edges_most_per_s:.0f} 1/s, {found.missed}",
            found.edges_most_per_s,
        ),
        ("steps at the peak", f"{found.steps_most_per_s:.0f} 1/s", found.steps_most_per_s),
        ("control tick, jitter", f"{us(period)} +- {us(jitter)}", jitter / CLOCK_HZ),
        (
            "control interrupt, longest with what interrupts it",
            f"{us(longest)} = {found.control_share:.1%}",
            longest / CLOCK_HZ,
        ),
        (
            "the same, every term of the controllers on",
            f"{us(every)} = {most.control_share:.1%}",
            every / CLOCK_HZ,
        ),
        (
            "control interrupt, longest by itself",
            us(found.control_own),
            found.control_own / CLOCK_HZ,
        ),
        ("control interrupt, mean", us(found.control_mean), found.control_mean / CLOCK_HZ),
        ("processor in interrupts", f"{found.interrupts_share:.1%}", found.interrupts_share),
        ("flash", f"{found.flash} of {firmware_load.FLASH_BYTES} bytes", found.flash),
        ("RAM, static", f"{found.ram_static} bytes", found.ram_static),
        (
            "RAM, deepest stack",
            f"{found.stack_most} bytes; {found.ram_share:.1%} of {firmware_load.RAM_BYTES} in all",
            found.stack_most,
        ),
        (
            "emulator, alone",
            f"{found.times_real_time_alone:.1f} x real time",
            found.times_real_time_alone,
        ),
        (
            "emulator, with light drives and host",
            f"{found.times_real_time:.1f} x real time",
            found.times_real_time,
        ),
        (
            "emulated experiment, with the rig's plant",
            f"{fast:.1f} x real time, {fast / alone:.0%} of alone",
            fast / alone,
        ),
    ]
