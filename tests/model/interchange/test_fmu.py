"""FMUs: valid by fmpy; the trajectory of `simulate`, with inputs that change, in a process that has
no flexura; and what the library answers to misuse."""

import io
import subprocess
import sys
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

import flexura as fx
from flexura.errors import InputError
from flexura.interchange import fmu, fmu_lacks
from flexura.signals.signal import from_segments

H = 0.01
T = np.arange(0.0, 0.4 + H / 2, H)


def unit(tmp_path, robot, fmi=2, **options):
    path = tmp_path / f"robot-{fmi}.fmu"
    path.write_bytes(fmu(robot, fmi, **options))
    return path


def forces(robot):
    """Forces (T, joints) that change with every step, and as fmpy takes them."""
    free = [i for i, link in enumerate(robot.links, 1) if not link.joint.locked]
    values = np.array([[0.02 * np.sin(20 * t + i) for i in range(len(robot.links))] for t in T])
    kinds = [("time", float), *((f"joint/{i}/drive", float) for i in free)]
    signals = np.zeros(len(T), np.dtype(kinds))
    signals["time"] = T
    for i in free:
        signals[f"joint/{i}/drive"] = values[:, i - 1]
    return values, signals


RUN = """
import sys
sys.modules["flexura"] = None  # what would import it fails
import fmpy, numpy
path, signals, names, rtol, out = sys.argv[1:]
found = fmpy.simulate_fmu(
    path, stop_time=0.4, output_interval=0.01, input=numpy.load(signals),
    output=names.split(","), start_values={"rtol": float(rtol)},
)
numpy.save(out, found)
"""


def simulated(tmp_path, path, robot, names, rtol):
    """An FMU's outputs, computed in a process without flexura."""
    _, signals = forces(robot)
    np.save(tmp_path / "signals.npy", signals)
    out = tmp_path / "found.npy"
    command = [sys.executable, "-c", RUN, str(path), str(tmp_path / "signals.npy")]
    command += [",".join(names), str(rtol), str(out)]
    subprocess.run(command, check=True, timeout=120, cwd=tmp_path)
    return np.load(out)


def inputs_and_outputs(path):
    read = fmpy.read_model_description(path).modelVariables
    return [[v.name for v in read if v.causality == kind] for kind in ("input", "output")]


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", ["type-1-rr", "rig"])
def test_an_fmu_runs_without_flexura_as_simulate_does(name, fmi, tmp_path):
    """All channels; forces hold for 10 ms, as a sampled controller's."""
    robot = fx.load(name)
    path = unit(tmp_path, robot, fmi)
    assert validate_fmu(str(path)) == []
    _, outputs = inputs_and_outputs(path)
    rtol = 1e-7
    found = simulated(tmp_path, path, robot, outputs, rtol)
    force, _ = forces(robot)
    drive = fx.Sampled(lambda t: force[round(t / H)], 1.0 / H)
    exact, same = (fx.simulate(robot, T, drive, rtol=tol) for tol in (1e-10, rtol))
    missing = {f"joint/{i}/drive" for i in (1, 2)} | set(fmu_lacks(robot))
    assert set(outputs) == set(exact.channels) - missing
    assert found["time"] == pytest.approx(T, abs=1e-12)
    for channel in outputs:
        largest = np.abs(exact[channel]).max()
        error, usual = (np.abs(x[channel] - exact[channel]).max() for x in (found, same))
        assert error <= max(2 * usual, 100 * rtol * largest + 1e-12), channel


def test_an_fmu_holds_one_library_that_needs_only_the_system(tmp_path):
    path = unit(tmp_path, "type-1-rr")
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        (library,) = [name for name in names if name.startswith("binaries/")]
        archive.extract(library, tmp_path)
    assert set(names) == {"modelDescription.xml", "resources/robot.bin", library}
    if sys.platform == "linux":
        needs = subprocess.run(
            ["ldd", str(tmp_path / library)], capture_output=True, text=True, check=True
        ).stdout.split("\n")
        found = {line.split()[0].rpartition("/")[2].partition(".")[0] for line in needs if line}
        assert found <= {"linux-vdso", "libm", "libc", "libpthread", "ld-linux-x86-64"}
    assert path.read_bytes() == fmu("type-1-rr")


class Slave:
    """An instance of an FMU of either version, with the messages of its log."""

    def __init__(self, path, fmi, folder, token=None):
        description = fmpy.read_model_description(path)
        self.folder = fmpy.extract(path, folder / "unpacked")
        self.of = {v.name: v.valueReference for v in description.modelVariables}
        self.fmi, self.said = fmi, []
        arguments = {
            "guid": token or description.guid,
            "modelIdentifier": description.coSimulation.modelIdentifier,
            "unzipDirectory": self.folder,
            "instanceName": "one",
        }
        if fmi == 3:
            arguments["guid"] = token or description.instantiationToken
            self.unit = FMU3Slave(**arguments)
            self.unit.instantiate(logMessage=self._log3)
        else:
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(self._log2)
            callbacks.allocateMemory = fmpy.fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
            callbacks.freeMemory = fmpy.fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
            self.unit = FMU2Slave(**arguments)
            self.unit.instantiate(callbacks=callbacks)

    def _log2(self, environment, instance, status, category, message):
        self.said.append(message.decode())

    def _log3(self, environment, status, category, message):
        self.said.append(message.decode())

    def get(self, *names):
        read = self.unit.getFloat64 if self.fmi == 3 else self.unit.getReal
        return read([self.of[name] for name in names])

    def set(self, name, value):
        write = self.unit.setFloat64 if self.fmi == 3 else self.unit.setReal
        write([self.of[name]], [value])

    def start(self, t=0.0, stop=None):
        if self.fmi == 2:
            self.unit.setupExperiment(startTime=t, stopTime=stop)
            self.unit.enterInitializationMode()
        else:
            self.unit.enterInitializationMode(startTime=t, stopTime=stop)
        self.unit.exitInitializationMode()

    def step(self, t, h):
        self.unit.doStep(t, h)

    def refused(self, call, said):
        with pytest.raises(fmpy.fmi1.FMICallException):
            call()
        assert said in self.said[-1]


@pytest.fixture(params=[2, 3])
def slave(request, tmp_path):
    slave = Slave(str(unit(tmp_path, "type-1-rr", request.param)), request.param, tmp_path)
    yield slave
    slave.unit.freeInstance()


def test_start_values_are_those_of_the_joints(slave):
    slave.set("joint/1/position", 0.3)
    slave.set("joint/2/velocity", -0.5)
    slave.start()
    q = fx.assemble("type-1-rr").start()
    q[0] = 0.3
    x, y, _ = fx.tip_pose("type-1-rr", q)
    assert slave.get("joint/1/position", "joint/2/velocity") == [0.3, -0.5]
    assert slave.get("tip/x", "tip/y") == pytest.approx([x, y], abs=1e-14)
    slave.refused(lambda: slave.set("joint/1/position", 0.1), "joint 1: its start is set before")


def test_a_state_is_kept_and_set_again(slave):
    get, put, free = (
        (slave.unit.getFMUState, slave.unit.setFMUState, slave.unit.freeFMUState)
        if slave.fmi == 3
        else (slave.unit.getFMUstate, slave.unit.setFMUstate, slave.unit.freeFMUstate)
    )
    shown = ("joint/1/position", "joint/2/velocity", "tip/x", "energy/work", "energy/kinetic")
    slave.start()
    slave.set("joint/1/drive", 0.2)
    slave.step(0.0, 0.1)
    kept, there = get(), slave.get("time", *shown)
    slave.set("joint/1/drive", -0.1)
    slave.step(0.1, 0.1)
    after = slave.get(*shown)
    put(kept)
    assert slave.get("time", *shown) == there
    assert slave.get("joint/1/drive") == [0.2]
    slave.set("joint/1/drive", -0.1)
    slave.step(0.1, 0.1)
    assert slave.get(*shown) == pytest.approx(after, rel=1e-5)
    free(kept)
    slave.unit.reset()
    slave.start()
    assert slave.get("time", "joint/1/drive", "energy/work") == [0.0, 0.0, 0.0]


def test_misuse_is_an_error_with_its_reason_in_the_log(slave):
    slave.refused(lambda: slave.step(0.0, 0.1), "has not been initialised")
    slave.refused(lambda: slave.set("rtol", 1.0), "between 1e-13 and 0.1")
    slave.refused(lambda: slave.set("tip/x", 1.0), "is no input")
    slave.start()
    slave.refused(lambda: slave.set("joint/1/drive", float("nan")), "expected a finite number")
    slave.refused(lambda: slave.step(0.5, 0.1), "the communication point is 0.5 s; the robot")
    slave.refused(lambda: slave.step(0.0, -0.1), "step above 0")
    slave.of["none"] = 100_000
    slave.refused(lambda: slave.get("none"), "there is no variable 100000")


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_joint_at_its_limit_ends_the_simulation(fmi, tmp_path):
    robot = fx.load("type-1-rr").replace({"link.1.joint.limits_rad": [-0.1, 0.1]})
    path = unit(tmp_path, robot, fmi)
    signals = np.array([(0.0, 0.5), (1.0, 0.5)], [("time", float), ("joint/1/drive", float)])
    found = fmpy.simulate_fmu(
        str(path), stop_time=1.0, output_interval=0.05, input=signals, output=["joint/1/position"]
    )
    run = fx.simulate(robot, np.linspace(0.0, 1.0, 21), fx.Drive.force(0.5, 0.0))
    assert found["joint/1/position"][-1] == pytest.approx(0.1, abs=1e-6)
    assert run.t[-1] - 1e-9 <= found["time"][-1] <= run.t[-1] + (0.05 if fmi == 3 else 1e-6)
    slave = Slave(str(path), fmi, tmp_path)
    slave.set("joint/1/position", 0.2)
    slave.refused(slave.start, "joint 1 starts at 0.2")
    slave.set("joint/1/position", 0.0)
    slave.start()
    slave.set("joint/1/drive", 0.5)
    if fmi == 2:
        slave.refused(lambda: slave.step(0.0, 0.5), "joint 1 meets its limit")
    else:
        slave.step(0.0, 0.5)
    slave.refused(lambda: slave.step(0.5, 0.1), "the simulation has ended: joint 1 meets its limit")
    slave.unit.freeInstance()


def test_inputs_go_on_by_their_derivatives(tmp_path):
    """FMI 2.0: a force of second order in time, by its value and two derivatives at each step."""
    slave = Slave(str(unit(tmp_path, "type-1-rr", rtol=1e-8)), 2, tmp_path)
    c = (0.1, -2.0, 6.0)
    slave.start(stop=T[-1])
    shown = []
    for t in T[:-1]:
        slave.set("joint/1/drive", c[0] + c[1] * t + c[2] * t**2)
        drive = [slave.of["joint/1/drive"]] * 2
        slave.unit.setRealInputDerivatives(drive, [1, 2], [c[1] + 2 * c[2] * t, 2 * c[2]])
        slave.step(t, H)
        shown.append(slave.get("tip/y", "link/2/tip_deflection"))
    slave.unit.freeInstance()
    quadratic = from_segments([[0.0, *c, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]], kind="quadratic")
    force = fx.Drive.force(quadratic, 0.0)
    run = fx.simulate("type-1-rr", T, force, rtol=1e-10)
    for column, name in enumerate(("tip/y", "link/2/tip_deflection")):
        error = np.abs(np.array(shown)[:, column] - run[name][1:]).max()
        assert error < 1e-6 * np.abs(run[name]).max()


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_description_of_another_robot_is_refused(fmi, tmp_path):
    path = unit(tmp_path, "type-1-rr", fmi)
    with pytest.raises(Exception, match="instantiate"):
        Slave(str(path), fmi, tmp_path, token="{another}")


@pytest.mark.parametrize("cut", [0, 7, 50, 300, -8])
def test_a_damaged_robot_is_no_instance(cut, tmp_path):
    path = unit(tmp_path, "type-1-rr")
    folder = fmpy.extract(str(path), tmp_path / "unpacked")
    robot = tmp_path / "unpacked" / "resources" / "robot.bin"
    whole = robot.read_bytes()
    description = fmpy.read_model_description(folder)
    for content in (whole[:cut], whole + b"12345678"):
        robot.write_bytes(content)
        one = FMU2Slave(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=folder,
            instanceName="one",
        )
        with pytest.raises(Exception, match="instantiate"):
            one.instantiate()


def test_links_under_gravity_start_in_equilibrium(tmp_path):
    robot = fx.load("two-link-arm").replace({"gravity_m_s2": [0.0, -9.81]})
    slave = Slave(str(unit(tmp_path, robot)), 2, tmp_path)
    slave.start()
    system = fx.assemble(robot)
    run = fx.simulate(robot, [0.0, 0.1])
    assert run.meta["start"] == "static" and system.n > 2
    names = [name for name in run.channels if name in slave.of and "drive" not in name]
    assert slave.get(*names) == pytest.approx([run[name][0] for name in names], abs=1e-9)
    slave.unit.freeInstance()


def test_what_cannot_be_an_fmu_is_refused():
    with pytest.raises(InputError, match="fmi = 1: expected 2 or 3"):
        fmu("rig", 1)
    with pytest.raises(InputError, match="stiffening = true"):
        fmu(fx.load("rig").replace({"stiffening": False}))
    with pytest.raises(InputError, match="rtol"):
        fmu("rig", rtol=1.0)


def test_sensors_of_internal_forces_are_left_out_and_named():
    spec = fx.load("rig").to_dict()
    kinds = ("bending_moment", "shear_force", "axial_force", "stress")
    extra = {"stress": {"distance_m": 1e-3}}
    spec["link"][-1]["sensor"] = [
        {"name": kind, "kind": kind, "at_m": 0.05} | extra.get(kind, {}) for kind in kinds
    ]
    robot = fx.Robot.from_dict(spec)
    assert fmu_lacks(robot) == [f"sensor/{kind}" for kind in kinds]
    with zipfile.ZipFile(io.BytesIO(fmu(robot))) as file:
        assert b"sensor/" not in file.read("modelDescription.xml")
