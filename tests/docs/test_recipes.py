"""The recipes of docs/guide/robots.md do what they say: closed forms, and what is conserved."""

import io
import re
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import beams
import flexura as fx
from beams import Beam, Body

PAGE = Path(__file__).resolve().parents[2] / "docs" / "guide" / "robots.md"


@cache
def page():
    """The names that the page's blocks of Python leave."""
    text, names = PAGE.read_text(encoding="utf-8"), {}
    with redirect_stdout(io.StringIO()):
        for block in re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
            exec(compile(block, str(PAGE), "exec"), names)
    return names


def test_the_arm_with_all_of_it_rings_as_a_beam_with_bodies():
    line, radius = Beam(0.7, 0.4, 6.0), 0.05
    bodies = [(0.4, Body(0.03)), (0.7, Body(0.2, 1e-4, 0.03))]
    arm = page()["arm"].replace({"link.1.elements": 32})
    hinge = lambda w: 100.0 - 1e-3 * w**2
    exact = beams.frequencies(line, hinge, bodies, 60.0, radius=radius)
    assert fx.frequencies(arm, count=3) == pytest.approx(exact, rel=1e-5)
    rotor = lambda w: 0.5 - 0.02 * w**2  # the spring beside the drive, and the rotor
    between = lambda w: 100.0 * rotor(w) / (100.0 + rotor(w)) - 1e-3 * w**2
    exact = beams.frequencies(line, between, bodies, 60.0, radius=radius)
    assert fx.frequencies(arm, joints="free", count=3) == pytest.approx(exact, rel=1e-5)


def test_a_shaken_cantilever():
    """Base excitation: the steady deflection is Re of -W int w phi dm; by modes."""
    run, length, mass, stiffness, beta = page()["shaken"], 0.4, 0.2, 0.5, 2e-3
    w, total = 2 * np.pi * 2.0, 0.0
    for b in (1.8751040687, 4.6940911330, 7.8547574382):
        own = b**2 * np.sqrt(stiffness / mass) / length**2
        sigma = (np.sinh(b) - np.sin(b)) / (np.cosh(b) + np.cos(b))
        shape_at_tip, mean = 2 * (-1) ** (round(b / np.pi - 0.5)), 2 * sigma / b
        total += shape_at_tip * mean * w**2 * 1e-3 / (own**2 - w**2 + 1j * beta * own**2 * w)
    found = np.abs(run["link/2/tip_deflection"][-400:]).max()
    assert found == pytest.approx(abs(total), rel=3e-3)


def test_a_floating_base_keeps_its_momentum():
    """Nothing acts from outside: the centre of mass stays, and nothing turns all in all."""
    robot, run = page()["satellite"], page()["floating"]
    assert run.meta["energy_error"] < 1e-5 and np.ptp(run["link/3/angle"]) > 0.01
    system, n = fx.assemble(robot), fx.assemble(robot).n
    places = np.linspace(0.0, 1.2, 401)
    weights = np.full(401, 0.2 * 1.2 / 400)
    weights[[0, -1]] /= 2
    for k in (0, 50, 100):
        q, v = run.states[k, :n], run.states[k, n:]
        x, y, _ = system.line(q, 4, places)
        centre = 4.0 * run["link/3/x"][k] + weights @ x, 4.0 * run["link/3/y"][k] + weights @ y
        if k == 0:
            first = centre
        assert centre == pytest.approx(first, abs=1e-5)
        momenta = (system.mass(q) @ v)[:2]  # of the two rails: linear momentum in x and y
        assert momenta == pytest.approx([0.0, 0.0], abs=1e-5)


def test_an_l_shaped_link():
    """The second leg rides lengthwise with the corner and turns with it, free at its end."""
    leg = Beam(0.4, 0.2, 0.5)

    def determinant(w):
        """Unknown: moment and shear at the clamp, and at the second leg's root."""
        lead = beams.advance(leg, 0.4, w)
        first = lead[:, 2:]  # deflection, slope, moment, shear at the corner
        corner = np.zeros((4, 4))
        corner[0, :2] = first[3] + w**2 * 0.2 * 0.4 * first[0]
        corner[1, :2], corner[1, 2] = first[2], -1.0
        corner[2:, :2] = np.outer(lead[2:, 1], first[1])
        corner[2:, 2:] = lead[2:, 2:]
        return float(np.linalg.det(corner / np.abs(corner).max(axis=1)[:, None]))

    exact = beams.roots(determinant, 60.0, 3)
    assert fx.frequencies(page()["bracket"], count=3) == pytest.approx(exact, rel=1e-4)


def test_a_telescope():
    """With a rigid outer tube it is a cantilever of the free length with its payload."""
    telescope, run = page()["telescope"], page()["extended"]
    stiff = telescope.replace({"link.1.bending_stiffness_N_m2": 1e10})
    for reach in (0.3, 0.8, 1.3):
        bot = stiff.replace({"link.2.joint.start_m": reach, "link.2.elements": 8})
        line = Beam(reach, 1.0, 1000.0)
        exact = beams.frequencies(line, lambda w: np.inf, [(reach, Body(2.0))], 2000.0, 1)
        assert fx.frequencies(bot, count=1) == pytest.approx(exact, rel=1e-4)
    assert run.complete and run.meta["energy_error"] < 1e-4
    assert np.hypot(run["tip/x"][-1], run["tip/y"][-1]) == pytest.approx(2.8, abs=0.01)
