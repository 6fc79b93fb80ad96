"""The table of analysis/README.md: python tests/identification_table.py [SEEDS], some minutes a rig on one core.

For each seed a rig drawn at random is excited for ten seconds on the emulated board and identified; a row says by how much the
estimates are off, in percent, and whether the 95 % interval holds the true value (* where it does not).
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from flexlab.identification.identify import Identified, identify
from rigs import excited

FACTORS = ("stiffness", "damping", "payload", "flex_gain")


def errors(found: Identified, truth: dict) -> dict[str, tuple[float, bool]]:
    """Relative error of every figure, and whether its interval holds the true value."""
    known = {name: (found.strip, name, truth["factors"][name]) for name in FACTORS}
    known["backlash"] = found.strip, "backlash_m", truth["backlash_m"]
    known["Coulomb"] = found.carriage, "coulomb_N", truth["joint_1_coulomb_N"]
    known["viscous"] = found.carriage, "viscous_N_s_m", truth["joint_1_viscous_N_s_m"]
    out = {}
    for title, (part, name, true) in known.items():
        low, high = part.interval(name)
        out[title] = part.values[name] / true - 1, low <= true <= high
    return out


def main(seeds: int) -> None:
    rows = []
    for seed in range(seeds):
        with tempfile.TemporaryDirectory() as folder:
            run = excited(seed, Path(folder)).run
        before = time.process_time()
        rows.append(errors(identify(run), run.meta["truth"]))
        spent = time.process_time() - before
        if seed == 0:
            print("| seed |", " | ".join(rows[0]), "| processor time |")
            print("| --- |", " | ".join("---:" for _ in rows[0]), "| ---: |")
        print(
            f"| {seed} |",
            " | ".join(f"{100 * e:+.2f}{'' if held else ' *'}" for e, held in rows[-1].values()),
            f"| {spent:.0f} s |",
            flush=True,
        )
    for word, value in (
        ("largest", lambda all_: f"{100 * max(abs(e) for e, _ in all_):.2f}"),
        ("held", lambda all_: f"{sum(h for _, h in all_)} of {len(all_)}"),
    ):
        print(f"| {word} |", " | ".join(value([row[name] for row in rows]) for name in rows[0]), "| |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
