"""Forward and inverse dynamics: drives in, motion out, to a tolerance."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import core, dense, nodal
from .control import PID, Controller
from .drive import Drive
from .errors import InputError
from .record import limit_event, record
from .run import Run
from .sampled import Sampled, as_function
from .signals import COLUMNS, Signal
from .system import System, system_of

if TYPE_CHECKING:
    from .batch import Batch
    from .population import Population

METHODS = ("auto", "explicit", "implicit", "exponential")
SHORT = ("explicit-3", "explicit-5")  # what "auto" takes under a Controller whose ticks are short
STEPS_A_CALL = 400  # between two looks at the progress bar and the keyboard
MOST_STEPS = 50_000_000  # of a run


@overload
def simulate(
    robot: Batch, t_eval: Any, drive: Drive | None = None, q0: Any = None, qd0: Any = None, rtol: float = 1e-6, *,
    method: str = "auto", numerical_damping: bool = True, progress: Callable[[float], None] | None = None, **population: Any,
) -> Population: ...  # fmt: skip
@overload
def simulate(
    robot: Any, t_eval: Any, drive: Drive | Controller | Sampled | Callable[..., Any] | None = None, q0: Any = None,
    qd0: Any = None, rtol: float = 1e-6, *, method: str = "auto", numerical_damping: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Run: ...  # fmt: skip
def simulate(
    robot: Any, t_eval: Any, drive: Drive | Controller | Sampled | Callable[..., Any] | None = None, q0: Any = None,
    qd0: Any = None, rtol: float = 1e-6, *, method: str = "auto", numerical_damping: bool = True,
    progress: Callable[[float], None] | None = None, **population: Any,
) -> Run | Population:  # fmt: skip
    """Integrate the equations of motion from t_eval[0] on; the Run has its channels at t_eval (T,).

    A joint that reaches a limit of the robot file or the end of its link ends the run, and so does a tolerance that cannot be
    kept, a
    state that is not a number, and Ctrl-C: the Run then has what was computed until there, an event says what happened and
    where,
    and `meta["complete"]` is false. `meta["energy_error"]` is how far the energies are from balancing, relative to the
    largest; beyond 1e-3 an event says so, beyond 0.1 the run is not complete.

    Args: robot: a System, a Robot, a robot file, or a Batch of robots, which gives a Population (`population.simulate` says
    what else
        that takes); t_eval (T,): ascending times [s]; drive: a Drive, a sampled Controller, `Sampled(f, rate_Hz)`, or a
        function
        of (t) or (t, position, velocity, tip_deflection) that gives (links,) forces and torques [N or N m]: such a function
        may be
        called again for times within a step, never before its start, and must have no memory; q0, qd0 (n,): the state at the
        start, by default `system.start()` at rest; rtol: the error that is asked for, of deflections and of a thousandth of
        the tip's path; method: "auto", "explicit" (order 8), "implicit", or "exponential"; numerical_damping:
        exponential steps damp fast modes that change no output by more than the tolerance (integration.md (43)); False: they
        do not; progress: called with the finished fraction.

    Raises: InputError: an argument is not what is expected.
    """
    from .batch import Batch

    if isinstance(robot, Batch):
        from . import population as many

        if not (drive is None or isinstance(drive, Drive)):
            raise InputError("expected a Drive: a population runs in the core alone", key="drive", value=drive)
        return many.simulate(
            robot, t_eval, drive, q0, qd0, rtol, method=method, numerical_damping=numerical_damping, progress=progress,
            **population,
        )  # fmt: skip
    if population:
        raise InputError("expected this of a Batch only, not of one robot", key=next(iter(population)))
    system, t = system_of(robot), check(t_eval, rtol, method)
    joints = len(system.robot.links)
    acting = Drive.none(joints) if drive is None else drive
    if not isinstance(acting, Drive | Controller | Sampled):
        acting = as_function(acting, joints)
    q, qd = initial(system, t[0], acting, q0, qd0)
    if not system.exact:
        if isinstance(acting, Controller):
            expected = 'expected a robot with stiffening = true and sliding = "continuous" under a Controller'
            raise InputError(expected, key="drive", value="Controller")
        slow = nodal if system.robot.nodal else dense
        return slow.simulate(system, t, acting, q, qd, rtol, method, progress)
    return _Course(system, t, acting, q, qd, rtol, method, numerical_damping).run(progress)


def inverse(
    robot: Any, t_eval: Any, motion: Signal | Sequence[Signal], q0: Any = None, qd0: Any = None, rtol: float = 1e-6, *,
    method: str = "auto", progress: Callable[[float], None] | None = None,
) -> Run:  # fmt: skip
    """Inverse dynamics: joints follow `motion` exactly; the Run has `joint/i/drive`, the forces that this takes.

    The elastic unknowns are integrated from q0, qd0 (n,), whose joint entries are replaced by the motion's; nothing is
    approximated by
    a rigid robot and nothing iterated. Replaying the drives through `simulate` returns the motion.

    Args: motion: one Signal a joint; else as in `simulate`.

    Raises: InputError: an argument is not what is expected; a motion whose position or velocity jumps.
    """
    system = system_of(robot)
    motions = [motion] if isinstance(motion, Signal) else list(motion)
    if len(motions) != len(system.robot.links) or not all(isinstance(m, Signal) for m in motions):
        raise InputError(f"expected {len(system.robot.links)} Signals, one a joint", key="motion", value=len(motions))
    return simulate(system, t_eval, Drive.prescribed(*motions), q0, qd0, rtol, method=method, progress=progress)


class _Course:
    """A run of the core in progress."""

    def __init__(
        self, system: System, t: np.ndarray, drive: Any, q: np.ndarray, qd: np.ndarray, rtol: float, method: str,
        numerical_damping: bool = True,
    ) -> None:  # fmt: skip
        self.system, self.t, self.drive, self.rtol = system, t, drive, rtol
        joints = len(system.robot.links)
        follows, function, sampler, rate = np.zeros(joints, dtype=np.uint8), None, None, 0.0
        segments, ranges, gains = np.zeros((0, COLUMNS)), np.zeros((joints, 4), dtype=np.int64), np.zeros((joints, 2))
        sampled = np.zeros(joints, dtype=np.uint8)
        if isinstance(drive, Drive):
            segments, ranges, gains = drive.packed()
            follows = drive.follows.astype(np.uint8)
        elif isinstance(drive, Controller):
            segments, ranges, gains, follows, sampled = drive.core_drives()
            sampler, rate = drive.sampler(system), float(drive.rate_Hz)
        elif isinstance(drive, Sampled):
            sampler, rate = core.PythonSampler(system.equations, as_function(drive.function, joints)), float(drive.rate_Hz)
        else:
            function = drive
        self.sampler = sampler
        self.core = core.Simulation(
            system.equations, t, q, qd, rtol, method, np.ascontiguousarray(segments), ranges, np.ascontiguousarray(gains),
            follows,
            sampled, np.ascontiguousarray(system.limits), function, sampler, rate, 0.0, numerical_damping,
            MOST_STEPS,
        )  # fmt: skip

    def run(self, progress: Callable[[float], None] | None) -> Run:
        begun, t = time.perf_counter(), self.t
        interrupted = False
        try:
            while len(t) > 1 and self.core.advance(STEPS_A_CALL):
                if progress is not None:
                    progress((self.core.progress()["t"] - t[0]) / (t[-1] - t[0]))
            if len(t) == 1:
                self.core.advance(1)
            if progress is not None and self.core.progress()["status"] == "done":
                progress(1.0)
        except KeyboardInterrupt:
            interrupted = True
        about = self.core.progress()
        times, states, accounts, forces = (np.asarray(a) for a in self.core.rows())
        events = [] if interrupted else self._events(about)
        if interrupted or about["status"] == "interrupted":
            events = [{"t": about["t"], "level": "WARN", "text": "interrupted"}]
        meta: dict[str, Any] = {
            "steps": about["steps"], "rejected": about["rejected"], "evaluations": about["passes"],
            "wall_s": time.perf_counter() - begun, "complete": about["status"] == "done" and not interrupted, "events": events,
            "drive": self.drive.spec() if hasattr(self.drive, "spec") else "Python function",
            "rtol": self.rtol, "method": about["method"],
        }  # fmt: skip
        run = record(self.system, times, states, accounts, forces, meta)
        if isinstance(self.drive, Controller):
            run = self.drive.recorded(run, self.sampler)
        return run

    def _events(self, about: dict[str, Any]) -> list[dict[str, Any]]:
        """What ended the run, if it is not its time."""
        status, at = about["status"], float(about["t"])
        if status == "done":
            return []
        z = np.asarray(self.core.state())
        if status == "limit":
            return [limit_event(self.system, int(about["joint"]), at, z[self.system.joint_rows])]
        i = int(about["joint"]) + 1
        where = "" if i == 0 else f" in {'the bending of link' if about['elastic'] else 'joint'} {i}"
        what = {
            "stuck": f"no step is short enough for rtol = {self.rtol:g}{where}; try another tolerance or method, look at gains "
            "and forces",
            "diverged": f"the state is not a number any more{where}; a gain, a force or a start value is too large",
            "exhausted": f'{MOST_STEPS} steps are used up{where}; try method = "implicit", a larger rtol or a shorter time',
        }[status]
        return [{"t": at, "level": "ERROR", "text": f"the simulation got no further than t = {at:.6g} s: {what}"}]


def check(t_eval: Any, rtol: float, method: str) -> np.ndarray:
    """The times (T,) of a request whose tolerance and method are good. Raises InputError."""
    t = _times(t_eval)
    if not 1e-13 <= rtol <= 0.1:
        raise InputError("expected a relative tolerance between 1e-13 and 0.1", key="rtol", value=rtol)
    if method not in METHODS + SHORT:
        raise InputError(f"expected one of {', '.join(METHODS)}", key="method", value=method)
    return t


def initial(system: System, t: float, drive: Any, q0: Any, qd0: Any) -> tuple[np.ndarray, np.ndarray]:
    """q and qd (n,) at the start t [s]: as given, locked joints at rest, prescribed ones on their motion. Raises InputError for
    wrong shapes, a drive of another number of joints, and a joint outside its limits."""
    q, qd = _state(system, "q0", q0, system.start()), _state(system, "qd0", qd0, np.zeros(system.n))
    qd[system.joint_rows[system.locked]] = 0.0
    if isinstance(drive, Drive | Controller):
        if len(drive.joints) != len(system.robot.links):
            raise InputError(
                f"expected {len(system.robot.links)} joint drives, one a joint", key="drive", value=len(drive.joints)
            )
        _put_on_motions(system, drive, t, q, qd)
    _inside_limits(system, q)
    return q, qd


def _times(t_eval: Any) -> np.ndarray:
    t = np.array(t_eval, dtype=float)
    if t.ndim != 1 or len(t) < 1 or not np.all(np.isfinite(t)) or not np.all(np.diff(t) > 0):
        raise InputError("expected ascending finite times in seconds, one or more", key="t_eval", value=t_eval)
    return t


def _state(system: System, key: str, value: Any, default: np.ndarray) -> np.ndarray:
    if value is None:
        return default
    array = np.array(value, dtype=float)
    if array.shape != (system.n,) or not np.all(np.isfinite(array)):
        raise InputError(f"expected {system.n} finite numbers, in the order of system.labels", key=key, value=value)
    return array


def _put_on_motions(system: System, drive: Drive | Controller, t: float, q: np.ndarray, qd: np.ndarray) -> None:
    for joint, row in zip(drive.joints, system.joint_rows, strict=True):
        if isinstance(joint, PID):
            qd[row] = 0.0 if joint.prescribed else qd[row]
        elif joint.prescribed and joint.motion is not None:
            q[row], qd[row], _ = joint.motion(t)


def _inside_limits(system: System, q: np.ndarray) -> None:
    for i, (link, row) in enumerate(zip(system.robot.links, system.joint_rows, strict=True), 1):
        if link.joint.limits is not None and not link.joint.limits[0] <= q[row] <= link.joint.limits[1]:
            raise outside(i - 1, link.joint.limits, float(q[row]))


def outside(joint: int, limits: tuple[float, float], position: float) -> InputError:
    """Why a joint (from 0) cannot start at a position."""
    return InputError(f"expected a start inside the limits of joint {joint + 1}, {list(limits)}", key="q0", value=position)
