"""The dissertation's nine structures against Exudyn: every row of `flexura crosscheck --all` is run
here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexlab.crosscheck import nine_structures

ROBOTS = Path(__file__).resolve().parents[3] / "model" / "robots"


DEAR = ("RPb", "PbR", "PbPa", "PbPb")


@pytest.mark.parametrize(
    "structure",
    [
        pytest.param(name, marks=pytest.mark.slow if name in DEAR else ())
        for name in sorted(nine_structures.FILES, key=lambda name: -name.count("Pb"))
    ],
)
def test_a_structure_agrees_with_exudyn(structure):
    """Positions, angles and tip deflections within what issue and references allow, with links bent
    by up to 1 %."""
    row = nine_structures._one(
        structure, fx.load(ROBOTS / f"{nine_structures.FILES[structure]}.toml")
    )
    assert row.check.complete and row.passed, {k: row.worst(k) for k in range(3)}
    assert 0.003 < row.bent <= 0.02
    moved = [np.ptp(row.check.simulation[f"joint/{i}/position"]) for i in (1, 2)]
    assert min(moved) > 1e-4
    assert row.check.twin.meta["program"].startswith("Exudyn") and row.check.twin.meta["wall_s"] > 0
    if row.sliding != "none":
        assert row.check.twin.meta["extrapolation"]


def test_the_nine_are_all_there_and_are_what_their_names_say(tmp_path):
    assert len(nine_structures.FILES) == 9
    for structure, file in nine_structures.FILES.items():
        assert fx.load(ROBOTS / f"{file}.toml").structure == structure
        (tmp_path / f"{file}.toml").write_text((ROBOTS / "rig.toml").read_text())
    with pytest.raises(fx.InputError, match="expected a robot of structure RR"):
        nine_structures.crosscheck_nine(tmp_path)
