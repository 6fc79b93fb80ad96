"""What a population is asked for, the same for all its robots; and how one request is told from
another."""

from __future__ import annotations

import hashlib
import pickle
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..errors import InputError
from ..io import Tables, array, choice, flag, function_of
from ..robot import Robot
from ..signals import STARTS, Acting, Drive, LoadsLike, PayloadsLike
from ..simulation.internal_forces import force_units
from ..simulation.problem import MOST_STEPS, Budget, check_request
from ..simulation.recorder import channel_units, sensor_units
from ..simulation.start import note_motions
from ..system import System, check_continuous
from ..system.structure import structure


@dataclass(frozen=True)
class Request:
    """Times (T,) [s], the shared drive and start, what acts, tolerance and method, what is kept:
    channels, those of the internal forces too, or a function of them."""

    t: np.ndarray
    drive: Drive | None
    q0: np.ndarray | None
    qd0: np.ndarray | None
    rtol: float
    method: str
    start: str | None
    numerical_damping: bool
    channels: tuple[str, ...]
    reduce: Callable[[np.ndarray, dict[str, np.ndarray]], Any] | None
    max_steps: int = MOST_STEPS
    acting: Acting = field(default_factory=Acting)
    internal_forces: bool = False

    @staticmethod
    def checked(
        t_eval: ArrayLike,
        drive: Drive | None,
        q0: ArrayLike | None,
        qd0: ArrayLike | None,
        rtol: float,
        method: str,
        start: str | None,
        numerical_damping: bool,
        channels: Sequence[str] | None,
        reduce: Any,
        max_steps: int | None = None,
        loads: LoadsLike = None,
        payloads: PayloadsLike = None,
        internal_forces: bool = False,
    ) -> Request:
        """A request whose arguments are good as far as that can be told without a robot. Raises
        InputError."""
        t = check_request(t_eval, rtol, method)
        if reduce is not None:
            expected = "expected a function (t, channels) -> number or {name: number}"
            function_of(reduce, "reduce", (2,), expected)
        if channels is not None and (
            isinstance(channels, str)
            or not isinstance(channels, Sequence)
            or not all(isinstance(name, str) for name in channels)
        ):
            raise InputError("expected a list of channels", key="channels", value=channels)
        if start is not None:
            choice(start, "start", STARTS)
            if q0 is not None:
                raise InputError("expected q0 or start, not both", key="start", value=start)
        if drive is not None:
            drive = drive.within(float(t[0]), float(t[-1]))
        state = [
            None if q is None else array(q, key, "expected finite numbers", (None,))
            for key, q in (("q0", q0), ("qd0", qd0))
        ]
        return Request(
            t,
            drive,
            state[0],
            state[1],
            float(rtol),
            method,
            start,
            flag(numerical_damping, "numerical_damping"),
            tuple(channels or ()),
            reduce,
            Budget.checked(max_steps, None).steps,
            Acting.of(loads, payloads, float(t[0]), float(t[-1])),
            flag(internal_forces, "internal_forces"),
        )

    def fitted(self, robot: Robot) -> Request:
        """The request for robots like this one: with the default channels, and its names and shapes
        checked."""
        note_motions(robot, self.drive, self.t)
        known, links = units_of(robot), robot.links
        default = [f"joint/{i}/position" for i in range(1, len(links) + 1)]
        default += [f"link/{i}/tip_deflection" for i, link in enumerate(links, 1) if link.flexible]
        if self.internal_forces:
            check_continuous(System(robot))
        for name in self.channels:
            if name not in known:
                short = dict.fromkeys(re.sub(r"/\d+$", "/K", each) for each in known)
                text = f"expected one of {', '.join(short)}"
                raise InputError(text, key="channels", value=name)
        if self.drive is not None:
            check_drive(self.drive, len(links), "drive")
        for i, load in enumerate(self.acting.loads, 1):
            if load.link > len(links):
                expected = f"expected a link from 1 to {len(links)}"
                raise InputError(expected, key=f"load[{i}].link", value=load.link)
        for key, value in (("q0", self.q0), ("qd0", self.qd0)):
            n = 0 if value is None else structure(robot).n
            if value is not None and (value.shape != (n,) or not np.isfinite(value).all()):
                raise InputError(
                    f"expected {n} finite numbers, in the order of system.labels",
                    key=key,
                    value=value,
                )
        asked = dict.fromkeys(self.channels or default)
        asked |= dict.fromkeys(force_units(robot) if self.internal_forces else ())
        return replace(self, channels=tuple(asked))

    def reduced(self, channels: dict[str, np.ndarray], robot: int) -> Tables:
        """The numbers that `reduce` makes of a robot's channels. Raises InputError for anything
        else than numbers."""
        assert self.reduce is not None
        found = self.reduce(self.t, channels)
        numbers = found if isinstance(found, dict) else {"value": found}
        try:
            return {str(name): float(value) for name, value in numbers.items()}
        except (TypeError, ValueError):
            text = f"expected a number or a dictionary of numbers of robot {robot + 1}"
            raise InputError(text, key="reduce", value=found) from None

    def spec(self) -> Tables:
        """The request as JSON can hold it: two requests that are equal here give the same numbers
        of the same robots."""
        start = [None if q is None else q.tolist() for q in (self.q0, self.qd0)]
        return {
            "program": program(),
            "t_s": self.t.tolist(),
            "drive": None if self.drive is None else [joint.spec() for joint in self.drive.joints],
            "acting": self.acting.spec() | {"digest": self.acting.digest} if self.acting else None,
            "q0": start[0],
            "qd0": start[1],
            "rtol": self.rtol,
            "method": self.method,
            "start": self.start,
            "numerical_damping": self.numerical_damping,
            "channels": list(self.channels),
            "max_steps": self.max_steps,
            "reduce": None if self.reduce is None else identity(self.reduce),
        }


def units_of(robot: Robot) -> dict[str, str]:
    """The channels that the robots of a population have, and their units: those of one run with its
    sensors and internal forces."""
    forces = {} if robot.nodal else force_units(robot)
    return channel_units(robot) | sensor_units(robot) | forces


def check_drive(drive: Drive, joints: int, key: str) -> None:
    """Raises InputError for a drive of another number of joints, or one with Python functions."""
    if len(drive.joints) != joints:
        raise InputError(
            f"expected {joints} joint drives, one a joint", key=key, value=len(drive.joints)
        )
    if drive.has_functions:
        raise InputError("expected Signals as forces: a population runs in the core alone", key=key)


@cache
def program() -> str:
    """The version and a digest of the solver: two equal ones compute the same numbers."""
    found, folder = hashlib.sha256(), Path(core.__file__).parent
    for source in [
        *sorted(folder.rglob("*.py")),
        *sorted(folder.glob("_core_*")),
    ]:  # the core in all builds that are installed
        found.update(source.read_bytes())
    return f"flexura {version('flexura')} {found.hexdigest()[:16]}"


def identity(function: Callable[..., Any]) -> str:
    """A function's name and a digest of its code, defaults and the values that it closes over, so
    that a changed one is noticed.

    Raises InputError for values that do not pickle. What it calls in other modules is taken as it
    is.
    """
    plain = getattr(function, "py_func", function)
    code = getattr(plain, "__code__", None)
    if code is None:
        content: Any = plain
    else:
        closed = [cell.cell_contents for cell in plain.__closure__ or ()]
        content = (_code(code), plain.__defaults__, plain.__kwdefaults__, closed)
    try:
        found = hashlib.sha256(pickle.dumps(content)).hexdigest()[:16]
    except (pickle.PicklingError, AttributeError, TypeError):
        raise InputError(
            "expected a function that closes over plain values", key="reduce", value=function
        ) from None
    return f"{getattr(plain, '__qualname__', type(plain).__name__)} {found}"


def _code(code: CodeType) -> tuple[Any, ...]:
    constants = tuple(_code(c) if isinstance(c, CodeType) else repr(c) for c in code.co_consts)
    return code.co_code, constants, code.co_names, code.co_varnames
