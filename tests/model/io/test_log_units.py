"""Units that are read in two ways, clocks that are slow, channels that are none."""

import numpy as np
import pytest

import flexura as fx
from flexlab.runs.export import as_csv
from flexura.io.logs import read_log, read_map, understood

T = np.arange(20.0)


def log(folder, head, step=0.01):
    path = folder / "log.csv"
    path.write_text(f"{head}\n" + "".join(f"{step * k:g},{k}\n" for k in range(20)))
    return read_log(path)


def by_map(folder, text):
    (folder / "map.toml").write_text(text)
    return read_map(folder / "map.toml")


def both(folder, name, unit):
    """A channel's values, of a log and of a Run."""
    run = fx.Run(T, {name: T}, {name: unit})
    found = understood(log(folder, f"t [s],{name} [{unit}]")).run
    assert found.units == run.units and (found[name] == run[name]).all()
    return found


@pytest.mark.parametrize("unit", ["ms-2", "ms^-2", "ms⁻²", "m s-2"])
def test_metres_per_second_squared_are_no_milliseconds(unit, tmp_path):
    run = both(tmp_path, "sensor/a", unit)
    assert run.units["sensor/a"] == "m/s^2" and run["sensor/a"][3] == 3.0


@pytest.mark.parametrize("unit", ["1/min", "min-1", "min^-1", "min⁻¹", "r/min"])
def test_turns_a_minute(unit, tmp_path):
    run = both(tmp_path, "joint/1/velocity", unit)
    assert run["joint/1/velocity"][3] == pytest.approx(np.pi / 10, rel=1e-15)


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        ("Grad", "deg or gon"),
        ("GRAD", "deg or gon"),
        ("ms-1", "m/s or 1/ms"),
        ("ms^-1", "m/s or 1/ms"),
        ("ms⁻¹", "m/s or 1/ms"),
    ],
)
@pytest.mark.parametrize("name", ["joint/1/velocity", "sensor/v"])
def test_a_unit_that_may_be_two_is_refused(name, unit, said, tmp_path):
    for head in (f"t [s],{name} [{unit}]", f"t,{name}\ns,{unit}"):
        with pytest.raises(fx.InputError, match=rf"log.csv: unit of column .*may be {said}"):
            understood(log(tmp_path, head))
    with pytest.raises(fx.InputError, match=f"unit of {name} = .*may be {said}"):
        fx.Run(T, {name: T}, {name: unit})
    text = f'[channel."{name}"]\ncolumn = 2\nunit = "{unit}"\n'
    with pytest.raises(fx.InputError, match=rf"map.toml: channel.*unit = .*may be {said}"):
        by_map(tmp_path, text)


@pytest.mark.parametrize("unit", ["Grad/s", "Mrad", "krad", "Mm", "Gm", "Gs", "MA", "ms2"])
def test_no_sensor_has_such_a_unit(unit, tmp_path):
    with pytest.raises(fx.InputError, match="a unit that is not known"):
        understood(log(tmp_path, f"t [s],joint/1/position [{unit}]"))


POSITION = '[channel."joint/1/position"]\ncolumn = 2\nunit = "rad"\n'


@pytest.mark.parametrize(
    ("head", "asked", "step"),
    [
        ("t [s]", '[time]\ncolumn = 1\nunit = "s"\n', 1.5),
        ("t [min]", "", 90.0),
        ("t [ms]", "", 0.0015e3),
        ("t", '[time]\ncolumn = 1\nunit = "s"\n', 1.5),
        ("t", "[time]\nrate_Hz = 0.5\n", 2.0),
    ],
)
def test_a_slow_clock_is_read_where_its_unit_is_stated(head, asked, step, tmp_path):
    scale = 1e3 if "ms" in head else 1.0
    read = log(tmp_path, f"{head},joint/1/position [rad]", 1.5 * scale)
    found = understood(read, by_map(tmp_path, asked + POSITION) if asked else None)
    assert found.run.t[1] == pytest.approx(step if scale == 1 else 1.5, rel=1e-12)
    assert bool(asked) != any("samples a second: is" in note for note in found.notes)
    assert (fx.Run.read(found.run.save(tmp_path / "run")).t == found.run.t).all()
    (tmp_path / "again.csv").write_bytes(as_csv.write(found.run))
    assert (understood(read_log(tmp_path / "again.csv")).run.t == found.run.t).all()


@pytest.mark.parametrize("head", ["t", "t [s]", "t_s"])
def test_a_slow_clock_of_seconds_needs_a_map(head, tmp_path):
    """Milliseconds often stand under a head of seconds."""
    read = log(tmp_path, f"{head},joint/1/position [rad]", 1.5)
    with pytest.raises(fx.InputError, match=r'row 2 .*milliseconds .* map .*unit = "s"'):
        understood(read)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("joint/1/pos", "did you mean joint/1/position?"),
        ("joint/3/speed", "did you mean joint/3/"),
        ("sensor/", "did you mean sensor/NAME?"),
        ("tip_x", "did you mean tip/x?"),
        ("speed", "expected a channel, or sensor/NAME"),
    ],
)
def test_an_unknown_channel_in_a_map_is_refused(name, said, tmp_path):
    with pytest.raises(fx.InputError) as caught:
        by_map(tmp_path, f'[channel."{name}"]\ncolumn = 2\n')
    assert f'map.toml: channel."{name}": an unknown channel; {said}' in str(caught.value)
