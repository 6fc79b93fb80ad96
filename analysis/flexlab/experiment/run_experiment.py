"""One experiment from its plan to its Run; everything received is recorded on the way."""

from __future__ import annotations

import datetime
import importlib.metadata
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.errors import FlexuraError, InputError

from ..board.base import Board, BoardError
from ..board.commissioning import Program, commission, program, where
from ..board.emulator.emulated import EmulatedBoard
from ..board.protocol.declaration import BAUD_BIT_S, PINS
from ..board.protocol.session import Link
from ..board.serial_port import SerialBoard
from ..recordings.recording import Recording, RecordingBoard
from ..recordings.run_from_recording import knots_spec, run_from_recording
from ..recordings.strip_sensor import sensor_spec
from ..recordings.unit_conversion import Sensor
from ..rig import Check, RigSetup, configuration
from ..rig.plant.plant import rig_plant
from .flash import build
from .plan import Plan
from .selftest import prepare, run_selftest
from .stream import StreamResult, execute, stop_motors

SETTLE_S = {"forward": 1.0, "inverse": 0.5, "step": 0.5, "free-vibration": 0.0}


class RefusedToStart(FlexuraError):
    """A person did not want the experiment to start."""


@dataclass(frozen=True)
class OpenBoard:
    """A board with what is known of it.

    `truth`: an emulated plant's own parameters, to judge an identification. `cut`: the entry of
    [pins] whose wire was cut.
    """

    board: Board
    seed: int | None = None
    truth: dict[str, Any] = field(default_factory=dict)
    plant: Any = None
    cut: str = ""

    @property
    def broken(self) -> str:
        """What is broken, in words."""
        return f"wire of {self.cut} ({where(self.cut)}) cut" if self.cut else ""


@dataclass(frozen=True)
class Hooks:
    """What the person at the bench sees and says; each has a default.

    `tested`: gets the checks. `say`: gets what the person is to do. `may_start`: the countdown,
    returns why not, or "". `stop_asked`: why to stop, or "". `observe`: gets new reports and the
    finished fraction.
    """

    tested: Callable[[list[Check]], None] = lambda findings: None
    say: Callable[[str], None] = lambda text: None  # what the person is to do
    may_start: Callable[[Link], str] = lambda link: ""  # the countdown; says why not
    stop_asked: Callable[[], str] = lambda: ""
    observe: Callable[[np.ndarray, float], None] = lambda reports, part: None


@dataclass(frozen=True)
class ExperimentResult:
    """A finished experiment."""

    run: fx.Run
    folder: Path
    findings: list[Check]
    ended: StreamResult


def check(plan: Plan) -> None:
    """Check that the rig can follow a plan.

    Raises:
        InputError: names the first failed check.
    """
    if plan.failed:
        first = plan.failed[0]
        expected = f"the rig cannot do this: expected {first.expected}; {first.advice}"
        raise InputError(expected, key=first.what, value=first.found, more=len(plan.failed) - 1)


def open_board(
    setup: RigSetup,
    port: str | None,
    seed: int = 0,
    elf: Path | None = None,
    cut: str | None = None,
) -> OpenBoard:
    """Open the board at a serial port, or an emulated board with the rig's plant.

    Args:
        setup: the rig.
        port: serial port; None: an emulated board.
        seed: of the emulated rig's noise.
        elf: the firmware of an emulated board; by default it is built.
        cut: entry of [pins] whose wire is cut, of an emulated board.

    Raises:
        InputError: there is no such port or pin, or a real board's wire is to be cut.
    """
    if cut is not None and cut not in PINS:
        raise InputError(f"expected one of [pins]: {', '.join(PINS)}", key="--cut", value=cut)
    if port is not None:
        if cut is not None:
            raise InputError(
                "expected an emulated board: a real one's wires are cut by hand",
                key="--cut",
                value=cut,
            )
        if not Path(port).exists():
            raise InputError(
                "no such device: expected the board's serial port", key="--port", value=port
            )
        return OpenBoard(SerialBoard(port, BAUD_BIT_S))
    plant = rig_plant(setup, seed)
    board = EmulatedBoard(elf or build(), plant)
    if cut is not None:
        board.cut(cut)
    return OpenBoard(board, seed, dict(plant.truth), plant, cut or "")


def session(setup: RigSetup, plan: Plan, opened: OpenBoard, sensor: Sensor) -> dict[str, Any]:
    """What is known before the board is greeted, for session.json and the run's metadata.

    Args:
        setup: the rig.
        plan: the experiment.
        opened: the board.
        sensor: of the strip, calibrated.
    """
    board = opened.board
    assert board.label.startswith("emulated") == board.emulated
    return (
        {
            "kind": "experiment",
            "source": "experiment",
            "emulated": board.emulated,
            "label": board.label,
            "experiment": plan.experiment,
            "name": setup.robot.name,
            "structure": setup.robot.structure,
            "program": f"flexura {importlib.metadata.version('flexura')}",
            "robot": setup.robot.to_dict(),
            "rig": setup.rig.model_dump(mode="json"),
            "rig_file": setup.file,
            "host_version": importlib.metadata.version("flexura"),
            "seed": opened.seed,
            "started": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
            "asked": plan.asked,
            "phases": plan.phases,
            "settings": plan.settings,
            "knots": knots_spec(plan.knots),
        }
        | sensor_spec(sensor)
        | ({"plant": type(opened.plant).__name__, "truth": opened.truth} if board.emulated else {})
        | ({"cut": opened.cut} if opened.cut else {})
    )


def conduct(
    setup: RigSetup,
    plan: Plan,
    opened: OpenBoard,
    folder: Path,
    sensor: Sensor,
    watch: Hooks,
    configure: bool = False,
    replace: bool = False,
    reference: bool = True,
) -> ExperimentResult:
    """Test the rig, start and execute a plan, and make the Run.

    What happens after the start is in the result's `ended`. A recording in which nothing moved is
    removed.

    Args:
        setup: the rig.
        plan: the experiment.
        opened: the board.
        folder: of the recording.
        sensor: of the strip, calibrated.
        watch: what the person sees and says.
        configure: whether the rig's settings may be written into a board that has others.
        replace: whether a recording in `folder` may be replaced.
        reference: whether the board is told that the joints stand at 0; else it knows where they
            are from an experiment before on the same open board.

    Returns:
        The Run, its folder, the self-test's findings, and how the stream ended.

    Raises:
        InputError: the rig cannot follow the plan, or the folder holds a recording.
        BoardError: the board fails before anything moves.
        RefusedToStart: a person did not want it.
    """
    check(plan)
    recording = Recording(folder, session(setup, plan, opened, sensor), replace=replace)
    link = Link(RecordingBoard(opened.board, recording))
    try:
        findings = _ready(
            link,
            recording,
            setup,
            plan,
            sensor,
            opened.board.emulated or configure,
            lambda link: commission(link, opened.board, watch.say, watch.stop_asked),
            reference,
        )
        watch.tested(findings)
        if failed := [finding for finding in findings if not finding.passed]:
            if why := watch.stop_asked():
                raise RefusedToStart(f"not started: {why}")
            first = failed[0]
            raise BoardError(
                f"{link.board.label}: self-test: {first.what}: {first.found}; expected "
                f"{first.expected}; {first.advice}"
            )
        if why := watch.may_start(link):
            raise RefusedToStart(f"not started: {why}")
    except BaseException as error:
        stop_motors(link)
        recording.discard()
        if opened.cut and isinstance(error, BoardError):
            raise BoardError(f"{opened.broken}: {error}") from None
        raise
    try:
        ended = execute(
            link,
            plan.knots,
            recording,
            SETTLE_S[plan.experiment],
            watch.stop_asked,
            watch.observe,
            opened.broken,
        )
    finally:
        recording.close()
    run = run_from_recording(folder)
    # what a host that recovers recordings beside its own has made of this one is replaced
    run.save(folder, overwrite=True)
    if recording.failed is not None and ended.complete:
        raise recording.failed
    return ExperimentResult(run, folder, findings, ended)


def _ready(
    link: Link,
    recording: Recording,
    setup: RigSetup,
    plan: Plan,
    sensor: Sensor,
    write: bool,
    commission: Callable[[Link], Program],
    reference: bool,
) -> list[Check]:
    """Greet the board, configure and test it, and tell it, if `reference`, that the joints stand
    at 0."""
    identity = link.connect()
    runs = program(link)
    recording.write_session(
        firmware={
            "version": identity.firmware,
            "declaration": f"{identity.declaration:08x}",
            "compiler": identity.compiler,
            "protocol": identity.protocol,
            "hash": f"{runs.firmware:08x}",
            "pins": f"{runs.pins:08x}",
        }
    )
    findings = prepare(link, identity, configuration(setup), plan.settings, write, commission)
    if all(finding.passed for finding in findings):
        more, rest = run_selftest(link, plan.settings, sensor)
        findings += more
        recording.write_session(rest=rest.spec())
        if reference:
            link.command("reference", position_1=0, position_2=0, steps=0)
    return findings
