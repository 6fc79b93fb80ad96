"""An FMU put together: description, robot and library in one archive."""

from __future__ import annotations

import hashlib
import io
import keyword
import re
import uuid
import zipfile

from ...errors import InputError
from ...io import number
from ...robot import Robot, robot_of
from ...simulation.start import resolve_start
from ...system import RobotLike, assemble, static
from .description import Model, description
from .library import library
from .robot_file import robot_file
from .variables import variables

VERSIONS = (2, 3)
EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest that an archive can hold: the same bytes each time


def fmu(robot: RobotLike, fmi: int = 2, rtol: float = 1e-6) -> bytes:
    """A robot as an FMU for co-simulation.

    Variables have the names of channels. Inputs are the drives of the joints; they hold from one
    communication point to the next, or go on by their derivatives (FMI 2.0). Outputs are the other
    channels of a Run. Positions and velocities of the joints have start values. The links start
    straight, or under gravity in static equilibrium (50). `rtol` is a parameter. The equations
    and methods are those of `flexura.simulate`.

    The FMU holds the library of this machine's system. It needs neither flexura nor Python.

    Args:
        robot: a Robot, a System, or the path or name of a robot file.
        fmi: version of the interface, 2 or 3.
        rtol: relative tolerance that the parameter `rtol` begins with.

    Returns:
        Content of the file, a ZIP archive; the same bytes each time.

    Raises:
        InputError: an argument is not what is expected; a robot with `stiffening = false` or nodal
            sliding; the library was not compiled, or FMI has no name for this system.
        NoEquilibrium: it should start in static equilibrium, and there is none.
    """
    described = robot_of(robot)
    if fmi not in VERSIONS:
        raise InputError("expected 2 or 3", key="fmi", value=fmi)
    expected = "expected a relative tolerance between 1e-13 and 0.1"
    if not 1e-13 <= number(rtol, "rtol", expected) <= 0.1:
        raise InputError(expected, key="rtol", value=rtol)
    if not described.stiffening or described.nodal:
        expected = 'expected a robot with stiffening = true and sliding = "continuous"'
        raise InputError(expected, key="robot", value=described.name)
    system, name = assemble(described), identifier(described)
    in_equilibrium = resolve_start(described, None, None) == "static"
    q = static(system) if in_equilibrium else system.start()
    place, binary = library(fmi, name)
    content = robot_file(system, "", in_equilibrium, rtol)
    token = _token(fmi, content, binary)
    about = Model(
        described.name or name,
        name,
        token,
        f"planar robot with flexible links, joints {described.structure}",
        rtol,
    )
    files = {
        "modelDescription.xml": description(fmi, about, variables(system, q, rtol)),
        "resources/robot.bin": robot_file(system, token, in_equilibrium, rtol),
        place: binary,
    }
    return _archive(files)


def identifier(robot: Robot) -> str:
    """The robot's name as a name of C."""
    word = re.sub(r"\W+", "_", robot.name or "", flags=re.ASCII).strip("_").lower()
    if not word or not word[0].isalpha() or keyword.iskeyword(word):
        word = f"robot_{word}".strip("_")
    return word[:64]


def _token(fmi: int, *content: bytes) -> str:
    digest = hashlib.sha256(b"\0".join([str(fmi).encode(), *content])).digest()
    return f"{{{uuid.UUID(bytes=digest[:16], version=5)}}}"


def _archive(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name, EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(info, content)
    return out.getvalue()
