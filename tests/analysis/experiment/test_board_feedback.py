"""Feedback of the deflection, and the disturbance observer, on the emulated rig: the real firmware
before the plant with its dirt."""

import numpy as np
import pytest

from boards import BENCH, configured, elf
from experiments import SETTINGS, experiment
from flexlab.board.emulator.emulated import EmulatedBoard
from flexlab.experiment import plan as plans
from flexlab.experiment.run_experiment import OpenBoard
from flexlab.identification.vibration.damped_sinusoids import fit, strongest
from flexlab.rig.plant.plant import rig_plant

pytestmark = pytest.mark.slow
# the rotor's inertia at the screw and the back-EMF, over the force of a volt
NOMINAL = {"jo_1_V_s2_m": 2.5, "bo_1_V_s_m": 86.0}
# proportional and velocity terms alone
PLAIN = SETTINGS | {"ki_1_V_m_s": 0.0, "kc_1_V": 0.0}


def conducted(plan, folder):
    """The Run, and the plant's own tip deflections with their times (K, 2)."""
    plant = rig_plant(BENCH)
    board = EmulatedBoard(elf(), plant)
    board.simulator.write_eeprom(0, configured("debian", ()))
    advance, seen = plant.advance, []

    def watched(seconds, outputs):
        sensors = advance(seconds, outputs)
        seen.append((board.now(), plant.tip_deflection_m))
        return sensors

    plant.advance = watched
    run = experiment(plan, folder, opened=OpenBoard(board, 0, {}, None)).run
    return run, np.array(seen)


def damping(settings, folder):
    """Damping ratio of the strip's first mode for a second after a fast turn, of the plant's own
    tip."""
    run, seen = conducted(plans.free_vibration(BENCH, settings, 0.2, 3.0), folder)
    assert run.meta["complete"]
    begin = seen[-1, 0] - 3.0 + run.meta["asked"]["rings_from_s"] + 0.25
    t, w = seen[(seen[:, 0] > begin) & (seen[:, 0] < begin + 1.0)][::4].T
    mode = strongest(fit(t - t[0], w - w.mean()), t[-1] - t[0])
    assert mode.frequency == pytest.approx(4.6, abs=0.3)
    return mode.ratio


def test_with_the_deflection_fed_back_a_turn_rings_a_twentieth_as_long(tmp_path):
    """Damping ratio 0.0042 without, 0.084 with kf alone."""
    without = damping(SETTINGS, tmp_path / "without")
    fed_back = damping(SETTINGS | {"kf_2_rad_s_m": 20.0}, tmp_path / "with")
    assert without < 0.008 and fed_back > 0.07


def errors_mm(settings, folder):
    """Error long after a step of the carriage, and root mean square along the inverse law."""
    run, _ = conducted(plans.step(BENCH, settings, (0.005, 0.0), 2.5), folder / "step")
    off = run["joint/1/reference"] - run["joint/1/position"]
    end = np.abs(off[run.t > 1.5]).mean()
    run, _ = conducted(plans.inverse(BENCH, settings), folder / "inverse")
    off = run["joint/1/reference"] - run["joint/1/position"]
    assert run.meta["complete"]
    return 1e3 * end, 1e3 * np.sqrt(np.nanmean(off**2))


def test_with_the_observer_friction_leaves_no_error(tmp_path):
    """A step ends 0.125 mm off without, within a count (0.0125 mm) with; along the inverse law 0.55
    and 0.40 mm."""
    end, along = errors_mm(PLAIN, tmp_path / "without")
    observed = PLAIN | NOMINAL | {"observer_1_Hz": 5.0}
    end_observed, along_observed = errors_mm(observed, tmp_path / "with")
    assert end > 0.1 and end_observed < 0.02
    assert along_observed < 0.8 * along


@pytest.mark.parametrize(
    ("change", "faults"),
    [
        ({"kf_2_rad_s_m": -20.0}, "runaway_2 stall_2 following_2"),
        ({"kf_2_rad_s_m": 1000.0}, "runaway_2 stall_2 following_2"),
        ({"kg_2_rad_m": -3.0}, "runaway_2 stall_2 following_2"),
        ({"kg_2_rad_m": 3.0}, "runaway_2 stall_2 following_2"),
        ({"observer_1_Hz": 5.0, "bo_1_V_s_m": 2000.0}, "following_1 speed_1"),
    ],
)
def test_a_wrong_sign_and_a_gain_that_is_too_large_end_in_a_fault(tmp_path, change, faults):
    settings = SETTINGS | change
    plan = (
        plans.inverse(BENCH, settings)
        if "observer_1_Hz" in change
        else plans.free_vibration(BENCH, settings, 0.2, 3.0)
    )
    run, _ = conducted(plan, tmp_path / "run")
    said = run.meta["events"][-1]["text"]
    assert not run.meta["complete"] and said.split(":")[0].removeprefix("fault ") in faults, said
