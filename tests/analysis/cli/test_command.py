"""The command `flexura` as a shell sees it: exit status, what stands on stdout and stderr, and what
is left on disk."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexlab.cli.app import COMMANDS, app
from processes import command_line, environment, flexura

ROOT = Path(__file__).resolve().parents[3]
RIG = ROOT / "model" / "robots" / "rig.toml"
LAW = ROOT / "model" / "manoeuvres" / "rig-inverse-law.toml"
ENVIRONMENT = environment()
HELP = {name: CliRunner().invoke(app, [name, "--help"]) for name in COMMANDS}
HEAVY = ("exudyn", "rerun", "pyarrow", "matplotlib", "pymoo", "distributed")


@pytest.fixture(scope="module")
def warm(tmp_path_factory):
    """One short simulation, after which the solver is compiled; its result and its folder."""
    folder = tmp_path_factory.mktemp("warm")
    return flexura(
        "simulate", RIG, LAW, "--out", folder / "out", "--json", cwd=folder
    ), folder / "out"


CYCLOIDS = """
name = "two cycloids"
duration_s = 1.0
[[joint]]
motion = { kind = "cycloid", end = 0.05, duration_s = 0.8 }
kp = 5.0
[[joint]]
motion.kind = "zv"
motion.frequency_Hz = 5.48
motion.signal = { kind = "cycloid", end = 0.7, duration_s = 0.6 }
prescribed = true
"""

# --- help


def test_help_imports_nothing_heavy(tmp_path):
    code = (
        "import sys; from flexlab.cli.app import main\n"
        "for name in sys.argv[1:]:\n"
        "    sys.argv = ['flexura', *name.split(), '--help']\n"
        "    try: main()\n"
        "    except SystemExit as end: assert not end.code, name\n"
        f"    heavy = [m for m in {HEAVY} if m in sys.modules]\n"
        "    assert not heavy, (name, heavy)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "", *COMMANDS],
        cwd=tmp_path,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("Usage:") == 1 + len(COMMANDS) and done.stderr == ""


def test_help_names_every_command(tmp_path):
    done = flexura("--help", cwd=tmp_path)
    assert done.returncode == 0 and done.stderr == ""
    assert {"simulate", "frequencies", "crosscheck", "review", "doctor", "demo"} <= set(COMMANDS)
    assert all(re.search(rf"^\W*{name}\s+\w", done.stdout, re.MULTILINE) for name in COMMANDS)


# --- what is wrong is said in one line, and nothing is left

BAD_ROBOT = RIG.read_text().replace("2.0e11", "200.0")
BAD_LAW = LAW.read_text().replace('"harmonic"', '"sine"')
WRONG = {
    "simulate, a modulus in GPa": (
        ["simulate", "bad.toml"],
        "bad.toml: link[2].young_modulus_Pa = 200.0: expected",
    ),
    "frequencies, a modulus in GPa": (
        ["frequencies", "bad.toml"],
        "bad.toml: link[2].young_modulus_Pa = 200.0: expected",
    ),
    "crosscheck, a modulus in GPa": (
        ["crosscheck", "bad.toml"],
        "bad.toml: link[2].young_modulus_Pa = 200.0: expected",
    ),
    "no such file": (["simulate", "absent.toml"], "absent.toml: no such file"),
    "a folder": (["simulate", "."], ".: a directory"),
    "a wrong manoeuvre": (
        ["simulate", RIG, "law.toml"],
        "law.toml: joint[1].motion.kind = 'sine': expected one of",
    ),
    "a robot for a manoeuvre": (
        ["simulate", RIG, RIG],
        "a robot file: expected a manoeuvre file",
    ),
    "no motion to invert": (
        ["inverse", RIG, "free.toml"],
        "free.toml: joint[2].motion: missing: inverse dynamics needs a motion",
    ),
    "a motion that jumps": (
        ["inverse", RIG, "jump.toml"],
        "jump.toml: joint[1].motion: expected a motion without jumps",
    ),
    "a motion that nothing follows": (
        ["simulate", RIG, "rig-step"],
        "joint[1].motion: joint 1 has a motion, but neither gains nor prescribed",
    ),
    "a motion that nothing follows in the twin": (
        ["crosscheck", RIG, "rig-step"],
        "or call with --prescribed",
    ),
    "a controller of exact motions": (
        ["simulate", RIG, "rig-step", "--prescribed", "--controller", "rig"],
        "--controller = 'rig': expected without --prescribed",
    ),
    "a controller of many robots": (
        ["simulate", RIG, "rig-step", "--vary", "payload.mass_kg=0:1:2", "--controller", "rig"],
        "--controller = 'rig': expected without --vary",
    ),
    "nothing to prescribe": (
        ["simulate", RIG, "type-1-bang-bang", "--prescribed"],
        "missing: no joint has a motion to follow",
    ),
    "a start of another kind": (
        ["simulate", RIG, LAW, "--start", "bent"],
        'start = \'bent\': expected "static" or "straight"',
    ),
    "an unknown study": (["study", "mass", RIG], "KIND = 'mass': expected one of payload"),
    "a study of nothing": (
        ["study", "boundary", RIG],
        "expected a robot with a flexible link behind a joint Pb",
    ),
    "a tolerance beyond sense": (
        ["simulate", RIG, LAW, "--rtol", "5"],
        "rtol = 5.0: expected a relative tolerance",
    ),
    "an unknown method": (
        ["simulate", RIG, LAW, "--method", "euler"],
        "method = 'euler': expected",
    ),
    "an unknown beam": (
        ["crosscheck", RIG, LAW, "--beam", "timoshenko"],
        "beam = 'timoshenko': expected",
    ),
    "no run": (["review", "."], ".: no run here: expected a folder with run.parquet"),
}


@pytest.mark.parametrize("arguments, words", WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_line_on_stderr_with_status_2_and_leaves_nothing(
    arguments, words, tmp_path, warm
):
    (tmp_path / "bad.toml").write_text(BAD_ROBOT)
    (tmp_path / "law.toml").write_text(BAD_LAW)
    (tmp_path / "free.toml").write_text(CYCLOIDS[: CYCLOIDS.index("motion.kind")])
    (tmp_path / "jump.toml").write_text(
        CYCLOIDS.replace(
            '"cycloid", end = 0.05, duration_s = 0.8', '"step", value = 1.0, at_s = 0.5'
        )
    )
    (tmp_path / "held.toml").write_text(CYCLOIDS)
    before = sorted(tmp_path.rglob("*"))
    out = [] if arguments[0] in ("frequencies", "review") else ["--out", tmp_path / "out"]
    done = flexura(*arguments, *out, cwd=tmp_path)
    assert done.returncode == 2 and done.stdout == ""
    assert re.fullmatch(r"flexura: [^\n]+\n", done.stderr) and words in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "arguments",
    [["fly"], ["simulate"], ["simulate", RIG, "--speed", "1"], ["simulate", RIG, "--rtol", "a"]],
)
def test_a_wrong_command_line_has_status_2_and_says_where_help_is(arguments, tmp_path):
    done = flexura(*arguments, cwd=tmp_path)
    assert done.returncode == 2 and done.stdout == ""
    assert "--help" in done.stderr and "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


# --- simulate


def test_simulate_stores_a_run_and_its_json_parses(warm):
    done, folder = warm
    assert done.returncode == 0
    told, run = json.loads(done.stdout), fx.Run.read(folder)
    assert told["run"] == str(folder / "run.parquet") and [
        path.name for path in folder.iterdir()
    ] == ["run.parquet"]
    assert (
        told["complete"] and run.complete and told["end_s"] == run.t[-1] == 2.0 and len(run) == 401
    )
    assert (
        run.meta["manoeuvre"] == "inverse law of the dissertation, joint PD"
        and run.meta["source"] == "simulation"
    )
    assert fx.Robot.from_dict(run.meta["robot"]) == fx.load(RIG)
    for name in run:
        channel = told["channels"][name]
        assert channel["unit"] == run.units[name]
        assert (channel["start"], channel["highest"], channel["end"]) == (
            run[name][0],
            run[name].max(),
            run[name][-1],
        )
    assert abs(run["energy/kinetic"]).max() > 0 and told["energy_error"] < 1e-5


def test_simulate_without_a_manoeuvre_moves_every_joint_and_shows_a_table(warm, tmp_path):
    """Results go to logs/COMMAND-ROBOT-1 under the working folder."""
    done = flexura("simulate", RIG, cwd=tmp_path)
    run = fx.Run.read(tmp_path / "logs" / "simulate-rig-1")
    told = "no manoeuvre was given: joint 1 goes 0.05 m, joint 2 goes 0.3 rad in 1 s"
    assert done.returncode == 0 and done.stderr.startswith(told)
    assert all(np.ptp(run[f"joint/{i}/position"]) > 1e-3 for i in (1, 2))
    assert all(
        text in done.stdout
        for text in (
            "rig (type IV, PaR)",
            "joint/1/position",
            "link/2/tip_deflection",
            "stored logs",
            "start: straight",
        )
    )


def test_motions_are_followed_exactly_by_both_programs(warm, tmp_path):
    """The shipped steps, which no gains follow; and a controller without a manoeuvre."""
    done = flexura("crosscheck", RIG, "rig-step", "--prescribed", "--out", "a", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    runs = [fx.Run.read(tmp_path / "a" / name) for name in ("simulation", "twin")]
    for run in runs:
        assert run["joint/2/position"].max() == pytest.approx(np.pi / 4, abs=1e-9)
    done = flexura("simulate", RIG, "--controller", "rig", "--out", "b", cwd=tmp_path)
    assert done.returncode == 0
    run = fx.Run.read(tmp_path / "b")
    assert run["joint/2/reference"][-1] == pytest.approx(0.3, abs=1e-9)
    assert run["joint/2/position"][-1] == pytest.approx(0.3, abs=5e-3)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_ctrl_c_stores_what_there_is_and_marks_it_incomplete(number, warm, tmp_path):
    """The interrupt comes when the progress bar shows that the solver is at work."""
    law = (
        LAW.read_text()
        .replace("duration_s = 2.0", "duration_s = 200000.0")
        .replace("output_step_s = 0.005", "output_step_s = 2.0")
    )
    (tmp_path / "long.toml").write_text(law)
    command = command_line("simulate", RIG, "long.toml", "--out", "out")
    terminal, side = os.openpty()
    surroundings = ENVIRONMENT | {"TERM": "xterm"}
    with subprocess.Popen(
        command, cwd=tmp_path, env=surroundings, stdout=subprocess.PIPE, stderr=side, text=True
    ) as process:
        os.close(side)
        shown, deadline = b"", time.monotonic() + 120
        try:
            while not re.search(rb"[1-9]\d? %", shown):
                assert time.monotonic() < deadline, shown
                shown += os.read(terminal, 4096)
            process.send_signal(number)
            while True:  # until the other side is closed
                try:
                    said = os.read(terminal, 4096)
                except OSError:
                    break
                if not said:
                    break
                shown += said
            assert process.wait(60) == 130, shown.decode()[-3000:]
        finally:
            process.kill()
            os.close(terminal)
    run = fx.Run.read(tmp_path / "out")
    assert not run.complete and 1 < len(run) < 100001 and np.isfinite(run["tip/x"]).all()
    assert run.meta["events"][-1]["text"] == "interrupted"
    assert not list(tmp_path.rglob(".flexura-*"))


# --- inverse


def test_inverse_prints_the_drives_of_the_stored_run(warm, tmp_path):
    """The net energy is the work that the solver integrated along; joints follow their motions
    whatever gains the file has."""
    (tmp_path / "law.toml").write_text(CYCLOIDS)
    done = flexura("inverse", RIG, "law.toml", "--out", "out", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told, run = json.loads(done.stdout), fx.Run.read(tmp_path / "out")
    assert [row["joint"] for row in told["drives"]] == [1, 2] and told["energy_error"] < 1e-5
    for row in told["drives"]:
        drive, speed = run[f"joint/{row['joint']}/drive"], run[f"joint/{row['joint']}/velocity"]
        assert (
            abs(row["peak"]) == np.abs(drive).max()
            and row["unit"] == run.units[f"joint/{row['joint']}/drive"]
        )
        assert (
            row["peak_power_W"] == (drive * speed).max()
            and row["energy_in_J"] > row["energy_net_J"]
        )
        assert row["rms"] == pytest.approx(np.sqrt(np.mean(drive**2)), rel=0.02)
    net = sum(row["energy_net_J"] for row in told["drives"])
    assert net == pytest.approx(run["energy/work"][-1], abs=1e-3 * run["energy/work"].max())
    assert run["joint/1/position"][-1] == pytest.approx(0.05, abs=1e-12)
    table = flexura("inverse", RIG, "law.toml", cwd=tmp_path)
    assert table.returncode == 0 and f"{told['drives'][0]['peak']:.4g} N" in table.stdout
    assert (tmp_path / "logs" / "inverse-rig-law-1" / "run.parquet").is_file()


# --- study


def test_a_study_prints_its_finding_and_stores_its_files(warm, tmp_path):
    robots = ROOT / "model" / "robots"
    done = flexura(
        "study", "boundary", robots / "type-3-rpb.toml", "--values", "0.2:0.4:3", cwd=tmp_path
    )
    folder = tmp_path / "logs" / "study-boundary-type-3-rpb-1"
    assert done.returncode == 0 and done.stderr == "" and "REPRODUCED: sliding" in done.stdout
    assert sorted(path.name for path in folder.iterdir()) == [
        "study.parquet",
        "study.png",
        "study.svg",
    ]
    arguments = ("--values", "0.5:2:3", "--keep", "first", "--channels", "--out", "out", "--json")
    done = flexura("study", "length-ratio", RIG, *arguments, cwd=tmp_path)
    told = json.loads(done.stdout)
    assert (
        done.returncode == 0
        and told["finding"]["reproduced"]
        and [row["L1_m"] for row in told["rows"]] == [0.1] * 3
    )
    assert fx.Run.read(tmp_path / "out" / "runs" / "002").meta["case"]["ratio"] == pytest.approx(
        2.0
    )


# --- frequencies

LENGTH, MASS, STIFFNESS = 0.5, 0.2, 3.0
CANTILEVER = f"""
[[link]]
length_m = {LENGTH}
elements = 10
mass_per_length_kg_m = {MASS}
bending_stiffness_N_m2 = {STIFFNESS}
[link.joint]
type = "R"
"""


def test_frequencies_of_a_cantilever_are_those_of_the_books(tmp_path):
    """Clamped and free: cos b cosh b = -1. Hinged and free: tan b = tanh b, after the rotation at 0
    Hz."""
    (tmp_path / "cantilever.toml").write_text(CANTILEVER)
    done = flexura("frequencies", "cantilever.toml", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert done.returncode == 0 and done.stderr == ""
    scale = np.sqrt(STIFFNESS / (MASS * LENGTH**4)) / (2 * np.pi)
    np.testing.assert_allclose(
        told["locked_Hz"][:3],
        scale * np.array([1.87510407, 4.69409113, 7.85475744]) ** 2,
        rtol=3e-4,
    )
    np.testing.assert_allclose(
        told["free_Hz"][1:3], scale * np.array([3.92660231, 7.06858275]) ** 2, rtol=3e-4
    )
    assert abs(told["free_Hz"][0]) < 1e-3
    table = flexura("frequencies", "cantilever.toml", cwd=tmp_path)
    assert (
        table.returncode == 0
        and f"{told['locked_Hz'][0]:.5g}" in table.stdout
        and f"{told['free_Hz'][2]:.5g}" in table.stdout
    )


def test_zeros_of_a_beam_are_in_the_table_and_in_json(tmp_path):
    """From the torque at its root to its tip: 2 y^2, tan y = -tanh y; to its own angle: the clamped
    frequencies."""
    (tmp_path / "cantilever.toml").write_text(CANTILEVER)
    done = flexura("frequencies", "cantilever.toml", "--zeros", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    own, along, across = told["zeros"]
    assert done.returncode == 0 and own["notches_Hz"] == pytest.approx(told["locked_Hz"], rel=1e-5)
    assert not along["reached"] and across["output"] == "tip/y"
    scale = np.sqrt(STIFFNESS / (MASS * LENGTH**4))
    assert across["right_half_plane_1_s"][0] == pytest.approx(
        [2 * 2.36502037**2 * scale, 0], rel=1e-4
    )
    table = flexura("frequencies", "cantilever.toml", "--zeros", cwd=tmp_path).stdout
    assert "not moved" in table and f"{across['right_half_plane_1_s'][0][0]:.4g}" in table


@pytest.mark.parametrize("elements", [30, 100, 200])
def test_frequencies_of_a_fine_mesh_are_as_right(elements, tmp_path):
    (tmp_path / "cantilever.toml").write_text(
        CANTILEVER.replace("elements = 10", f"elements = {elements}")
    )
    system = fx.assemble(fx.load(tmp_path / "cantilever.toml"))
    scale = np.sqrt(STIFFNESS / (MASS * LENGTH**4)) / (2 * np.pi)
    np.testing.assert_allclose(
        fx.frequencies(system)[:2], scale * np.array([1.87510407, 4.69409113]) ** 2, rtol=1e-5
    )
    np.testing.assert_allclose(
        fx.frequencies(system, joints="free")[1], scale * 3.92660231**2, rtol=1e-5
    )


# --- crosscheck, doctor


def test_crosscheck_of_the_rig_passes_and_leaves_both_runs_and_their_review(warm, tmp_path):
    done = flexura("crosscheck", RIG, LAW, "--out", tmp_path / "out", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(done.stdout)
    assert told["passed"] and told["failed"] == [] and told["tolerance"] == 0.01
    assert told["channels"]["link/2/tip_deflection"]["max_relative"] < 0.01
    native, twin = (fx.Run.read(tmp_path / "out" / name) for name in ("simulation", "twin"))
    assert (
        (native.meta["source"], twin.meta["source"]) == ("simulation", "twin")
        and native.complete
        and twin.complete
    )
    assert (tmp_path / "out" / "review.rrd").stat().st_size > 10_000 and told["review"].endswith(
        "review.rrd"
    )


def test_crosscheck_beyond_its_tolerance_has_status_1_and_names_the_channels(warm, tmp_path):
    short = LAW.read_text().replace("duration_s = 2.0", "duration_s = 0.2")
    (tmp_path / "short.toml").write_text(short)
    done = flexura(
        *("crosscheck", RIG, "short.toml", "--out", "out", "--tolerance", "1e-12"), cwd=tmp_path
    )
    assert done.returncode == 1
    assert "beyond the tolerance" in done.stderr and "link/2/tip_deflection" in done.stderr
    assert fx.Run.read(tmp_path / "out" / "twin").complete


def test_doctor_has_status_0_where_nothing_is_missing(tmp_path):
    done = flexura("doctor", "--json", cwd=tmp_path)
    found = {finding["what"]: finding for finding in json.loads(done.stdout)}
    missing = [finding for finding in found.values() if finding["state"] == "missing"]
    assert done.returncode == (1 if missing else 0) and all(finding["cost"] for finding in missing)
    assert found["Python"]["state"] == found["numpy"]["state"] == found["pyarrow"]["state"] == "ok"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("becomes", ["SystemError('of a library')", "typer.Exit(1)"])
def test_an_interrupt_that_a_library_turns_into_an_error(becomes):
    """Compiled libraries do so while they are imported; `doctor` then finds them missing."""
    code = f"""if True:
        import os, signal, sys, time, typer
        import flexlab.cli.robots as command
        from flexlab.cli import app

        def robots():
            try:
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(60)
            except KeyboardInterrupt:
                raise {becomes}

        command.robots = robots
        sys.argv = ["flexura", "robots"]
        app.main()
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "flexura: interrupted\n")
