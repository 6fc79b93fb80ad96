"""The table of docs/guide/identification.md.

`python tests/support/identification_table.py [SEEDS] [FILE]`: a rig takes some 40 s on one core.

For each seed a rig drawn at random is excited for ten seconds on the emulated board and identified;
a row says by how much the estimates are off, in percent, and whether the 95 % interval holds the
true value (* where it does not). With a FILE each rig is kept there when it is done, and rigs that
it holds are not computed again: delete it when the program has changed.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

from flexlab.identification.identify_rig import Identified, identify
from rigs import excited

FACTORS = {"stiffness": "stiffness", "damping": "damping", "payload": "payload"}
FACTORS["flex_gain"] = "sensor_gain"


def errors(found: Identified, truth: dict) -> dict[str, tuple[float, bool]]:
    """Relative error of every figure, and whether its interval holds the true value."""
    known = {name: (found.strip, key, truth["factors"][name]) for name, key in FACTORS.items()}
    known["backlash"] = found.strip, "backlash", truth["factors"]["backlash"]
    known["Coulomb"] = found.joints[1], "coulomb", truth["joint_1"]["coulomb_N"]
    known["viscous"] = found.joints[1], "viscous", truth["joint_1"]["viscous_N_s_m"]
    out = {}
    for title, (part, name, true) in known.items():
        low, high = part.interval(name)
        out[title] = float(part.values[name] / true - 1), bool(low <= true <= high)
    return out


def rig(seed: int) -> dict:
    """One rig's row."""
    with tempfile.TemporaryDirectory() as folder:
        run = excited(seed, Path(folder)).run
    before = time.process_time()
    row = errors(identify(run), run.meta["truth"])
    return {"seed": seed, "spent_s": time.process_time() - before, "errors": row}


def main(seeds: int, file: Path | None) -> None:
    kept = (
        [json.loads(line) for line in file.read_text().splitlines()]
        if file and file.exists()
        else []
    )
    known = {row["seed"]: row for row in kept}
    for seed in range(seeds):
        if seed not in known:
            known[seed] = rig(seed)
            if file:
                with file.open("a") as out:
                    out.write(json.dumps(known[seed]) + "\n")
        row = known[seed]
        if seed == 0:
            print("| seed |", " | ".join(row["errors"]), "| processor time |")
            print("| --- |", " | ".join("---:" for _ in row["errors"]), "| ---: |")
        cells = (f"{100 * e:+.2f}{'' if held else ' *'}" for e, held in row["errors"].values())
        print(f"| {seed} |", " | ".join(cells), f"| {row['spent_s']:.0f} s |", flush=True)
    columns = list(zip(*(known[seed]["errors"].values() for seed in range(seeds)), strict=True))
    print(
        "| largest |",
        " | ".join(f"{100 * max(abs(e) for e, _ in each):.2f}" for each in columns),
        "| |",
    )
    print(
        "| held |", " | ".join(f"{sum(h for _, h in each)} of {seeds}" for each in columns), "| |"
    )


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 20,
        Path(sys.argv[2]) if len(sys.argv) > 2 else None,
    )
