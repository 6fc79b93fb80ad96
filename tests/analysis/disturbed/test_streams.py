"""Commands whose standard streams are closed, as `>&-` and some services have them."""

import subprocess

import numpy as np
import pytest

import flexura as fx
from processes import command_line, environment


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_command_with_closed_streams_runs_to_its_end(closed, tmp_path):
    (tmp_path / "log.csv").write_text("time [s],tip/x [m]\n0,1\n0.1,2\n0.2,3\n")
    for arguments in (["simulate", "rig"], ["import", "log.csv"]):
        line = [*command_line(*arguments, "--out", arguments[0])]
        done = subprocess.run(
            ["sh", "-c", f'exec "$@" {closed}', "sh", *line],
            cwd=tmp_path,
            env=environment(),
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0 and "Error" not in done.stderr, done.stderr
    assert len(fx.Run.read(tmp_path / "simulate")) > 100
    np.testing.assert_array_equal(fx.Run.read(tmp_path / "import")["tip/x"], [1, 2, 3])
