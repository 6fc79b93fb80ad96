"""The plant's mechanics against the model and theory."""

import ast
import math

import numpy as np
import pytest

import flexura as fx
from flexlab.rig.plant.mechanics import STEP_S, Mechanics
from plants import BENCH, ROOT, STIFF, vibration


def test_the_held_strip_vibrates_and_decays_as_the_model_says():
    """Clamped: the first frequency of the native model's mesh of 12 elements; decay beta omega^2 /
    2."""
    mechanics = Mechanics(BENCH.robot)
    mechanics.hold(0, *STIFF)
    mechanics.hold(1, 2e4, 0.0)
    for k in range(60):
        mechanics.step(0.0, 0.03 * (k + 1) / 60)
    deflection = np.empty(4000)
    for k in range(len(deflection)):
        mechanics.step(0.0, 0.03)
        deflection[k] = mechanics.tip_deflection_m
    t = np.arange(len(deflection)) * mechanics.step_s
    frequency, decay = vibration(t[600:], deflection[600:], 5.0)
    exact = fx.frequencies(
        fx.assemble(BENCH.robot.replace({"link.2.elements": 12})), joints="locked"
    )[0]
    assert frequency == pytest.approx(exact, rel=2e-3)
    assert decay == pytest.approx(0.5 * 2e-4 * (2 * math.pi * exact) ** 2, rel=0.02)


def test_energy_of_what_nothing_drives_or_damps_stays():
    """Thrown: carriage and strip turn and vibrate freely. The scheme damps what it does not
    resolve, and adds nothing."""
    mechanics = Mechanics(BENCH.robot.replace({"link.2.damping.beta_s": 0.0}))
    mechanics.hold(0, 1e3, 0.0)
    mechanics.hold(1, 2.0, 0.0)
    for k in range(round(0.05 / STEP_S)):
        mechanics.step(0.2 * STEP_S * k, 4.0 * STEP_S * k)
    mechanics.hold(0, 0.0, 0.0)
    mechanics.hold(1, 0.0, 0.0)
    energy = []
    for _ in range(round(1.0 / STEP_S)):
        mechanics.step(0.0, 0.0)
        energy.append(mechanics.energy_J)
    energy = np.array(energy[round(0.05 / STEP_S) :])
    assert abs(mechanics.positions[1]) > 1.0  # it did turn
    assert energy.max() <= energy[0] * (1 + 2e-3) and energy[-1] > 0.98 * energy[0]


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_the_sensor_integrates_the_slope_of_a_loaded_cantilever(angle):
    """w'(s) = P (L s - s^2/2) / EI + q (3 L^2 s - 3 L s^2 + s^3) / (6 EI), weight of payload and
    strip across the strip."""
    weight, (first, last) = 3.0, (0.002, 0.09725)
    gravity = [weight * math.sin(angle), -weight * math.cos(angle)]
    robot = BENCH.robot.replace({"gravity_m_s2": gravity, "link.2.damping.beta_s": 0.05})
    mechanics = Mechanics(robot, (0.0, angle), sensor_m=(first, last))
    mechanics.hold(0, *STIFF)
    mechanics.hold(1, 2e4, 0.0)
    for _ in range(3000):
        mechanics.step(0.0, angle)
    strip = robot.links[1]
    length, ei = strip.length_m, float(strip.bending_stiffness(np.zeros(1))[0])
    p, q = weight * robot.payload.mass_kg, weight * float(strip.mass_per_length(np.zeros(1))[0])

    def slope(s):
        return (
            -(p * (length * s - s**2 / 2) + q * (3 * length**2 * s - 3 * length * s**2 + s**3) / 6)
            / ei
        )

    assert mechanics.bend_rad == pytest.approx(slope(last) - slope(first), rel=3e-3)
    assert mechanics.tip_deflection_m == pytest.approx(
        -(p / 3 + q * length / 8) * length**3 / ei, rel=3e-3
    )


def test_a_plant_knows_nothing_of_the_native_solver():
    """The emulated rig and the twin's modules that it uses import none of the solver."""
    native = ("core", "link", "system", "control", "simulation", "population", "api")
    folders = [ROOT / "analysis/flexlab/rig/plant", ROOT / "model/flexura/twin"]
    for path in [p for folder in folders for p in folder.rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                parts = (node.module or "").split(".") + [a.name for a in node.names]
                assert not set(native) & set(parts), (path.name, ast.unparse(node))
