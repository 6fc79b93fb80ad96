"""A complete robot file to damage, and how its refusal is checked."""

import copy
import tomllib

import pytest
import tomli_w

import flexura as fx

COMPLETE = """
name = "rig (type IV, PaR)"
gravity_m_s2 = [0.0, 0.0]
stiffening = true
sliding = "continuous"

[[link]]
name = "carriage"
length_m = 0.10
elements = 0
mass_kg = 0.60
centre_of_mass_m = 0.05
inertia_kg_m2 = 5.0e-4
[link.joint]
type = "Pa"
angle_rad = 0.0
hub_mass_kg = 0.0
hub_inertia_kg_m2 = 0.0
rotor_mass_kg = 0.0
viscous_friction_N_s_m = 0.0
coulomb_friction_N = 0.0
limits_m = [-0.05, 0.15]

[[link]]
name = "strip"
length_m = 0.30
elements = 4
modes = 3
section = { width_m = 0.020, height_m = 0.001 }
young_modulus_Pa = 2.0e11
density_kg_m3 = 7850.0
damping = { alpha_1_s = 0.0, beta_s = 2.0e-4 }
[link.joint]
type = "R"

[payload]
mass_kg = 0.020
inertia_kg_m2 = 0.0
"""
BASE = tomllib.loads(COMPLETE)
ABSENT = object()


def changed(changes, base=BASE):
    """The tables of the complete robot file with some values put in or, with ABSENT, taken out;
    links counted from 1."""
    data = copy.deepcopy(base)
    for path, value in changes.items():
        *parents, last = path.split(".")
        table = data
        for part in parents:
            table = table[int(part) - 1] if isinstance(table, list) else table.setdefault(part, {})
        if value is ABSENT:
            table.pop(last, None)
        else:
            table[last] = value
    return data


def refused(path):
    """The error of a file that is refused; it is one printable line that begins with the file's
    name."""
    with pytest.raises(fx.InputError) as caught:
        fx.load(path)
    text = str(caught.value)
    assert text.isprintable() and len(text) < 700
    assert text.startswith(f"{path}: ") and caught.value.file == str(path)
    return caught.value


nan, inf = float("nan"), float("inf")
STRIP, CART = "link.2.", "link.1."


BY_NUMBER = {STRIP + key: ABSENT for key in ("section", "young_modulus_Pa", "density_kg_m3")} | {
    STRIP + "mass_per_length_kg_m": 0.157,
    STRIP + "bending_stiffness_N_m2": 0.3333,
}


def check_refused(folder, changes, key, value, words):
    """The complete file with `changes` is refused: the error names the key, shows the value (None:
    none to show), and has these words of what was expected."""
    path = folder / "wrong.toml"
    path.write_text(tomli_w.dumps(changed(changes)))
    error = refused(path)
    text = str(error)
    shown = repr(value)
    shown = shown if len(shown) <= 60 else shown[:57] + "..."
    assert error.key == key and words in error.expected
    assert text.startswith(f"{path}: {key}: " if value is None else f"{path}: {key} = {shown}: ")
    assert any(word in text for word in ("expected", "missing", "unknown key"))
