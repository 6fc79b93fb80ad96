"""The command `flexura`: its subcommands, and how errors end. Each is imported when it is called,
or a call would wait."""

from __future__ import annotations

import _thread
import errno
import gc
import importlib
import keyword
import os
import signal
import sys
import threading
from types import FrameType
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from flexura import __version__
from flexura.errors import FlexuraError, InputError, out_of_memory

from ..runs.formatting import printable
from .verbosity import set_verbosity

COMMANDS = {
    "simulate": "Simulate a robot; with --vary, a population of robots.",
    "inverse": "Compute the forces that a manoeuvre's motions take.",
    "invert": "Compute drives with which the tip follows a path.",
    "frequencies": "Compute natural frequencies, joints locked and free.",
    "crosscheck": "Simulate a robot here and in Exudyn, and compare both.",
    "study": "Study a robot's payload, link lengths, or sleeve.",
    "tune": "Find a controller's gains on the simulator.",
    "bench": "Run experiments on the rig, real or emulated.",
    "learn": "Repeat a manoeuvre on the rig until the tip follows.",
    "identify": "Identify physical parameters from an experiment.",
    "vibration": "Find frequency and damping of a free vibration.",
    "compare": "Compare an experiment with its simulation, or two runs.",
    "review": "Look at one run, or several side by side, in Rerun.",
    "plot": "Draw a run over time, for a screen or for print.",
    "animate": "Write a run as a film.",
    "import": "Read a log as a run, or a URDF as a robot.",
    "export": "Write a run or robot in another program's format.",
    "migrate": "Rename old keys of files.",
    "new": "Write a commented robot file to begin with.",
    "robots": "List the robots that come with flexura.",
    "flash": "Build the firmware and load it into the board.",
    "doctor": "Check the installation; list missing parts.",
    "demo": "Show the rig: simulation, cross-check, experiment.",
}


class Commands(TyperGroup):
    """A group whose commands stand in modules of the same name beside this one."""

    def __init__(self, **keys: Any) -> None:
        super().__init__(**keys)
        self.commands = dict.fromkeys(COMMANDS)  # type: ignore[assignment]  # for "Did you mean"

    def list_commands(self, ctx: Any) -> list[str]:
        """The names, in the order of a project's life."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Import a command; None for a name that is none."""
        if cmd_name not in COMMANDS:
            return None
        word = f"{cmd_name}_" if keyword.iskeyword(cmd_name) else cmd_name
        module = importlib.import_module(f"flexlab.cli.{word}")
        own = getattr(module, "app", None)
        if own is None:
            own = typer.Typer(**PLAIN)
            own.command(cmd_name)(getattr(module, word))
        command = typer.main.get_command(own)
        command.name = cmd_name
        return command

    def main(self, *args: Any, **keys: Any) -> Any:
        """Call a command; Ctrl-C ends it with a word, where it does not keep what it has."""
        try:
            return super().main(*args, **keys)
        except SystemExit as end:
            # typer ends an interrupt so, without a word
            told = isinstance(getattr(end.__context__, "__cause__", None), KeyboardInterrupt)
            if told or (end.code == 1 and _interrupted.is_set()):
                _end_interrupted()
            raise

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """The table of commands, without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


# what else than MemoryError says so: the loader of libraries, and threads
SHORT_OF_MEMORY = (
    "failed to map segment",
    "cannot allocate memory",
    "can't start new thread",
    "Failed to spawn background thread",
)
PLAIN: dict[str, Any] = {
    "add_completion": False,
    "rich_markup_mode": None,
    "pretty_exceptions_enable": False,
}
app = typer.Typer(name="flexura", cls=Commands, no_args_is_help=True, **PLAIN)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"flexura {__version__}")
        raise typer.Exit


@app.callback()
def flexura(
    version: Annotated[
        bool, typer.Option("--version", help="print the version", is_eager=True, callback=_version)
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", help="only results and errors: no progress, no notes")
    ] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="also which files are read, and the like")
    ] = False,
) -> None:
    """Robots with flexible links: simulate, cross-check, tune, measure, compare.

    One robot file describes the robot.
    """
    if quiet and verbose:
        raise InputError("expected --quiet or --verbose, not both", key="--quiet")
    set_verbosity(quiet=quiet, verbose=verbose)


def main() -> None:
    """Run the command; bad input ends in one line on stderr and status 2, whatever else goes wrong
    in status 1. typer prints the usage too where an option or a command is wrong."""
    # looking for garbage among a million objects just imported is a tenth of the start
    gc.set_threshold(100_000)
    _open_closed_streams()
    sys.unraisablehook = _unraisable
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
    for name in ("SIGTERM", "SIGHUP"):  # end as Ctrl-C does: what is not finished is removed
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _interrupt)
    try:
        _refuse_empty(sys.argv[1:])
        app()
    except KeyboardInterrupt:
        _end_interrupted()
    except OSError as error:
        if error.errno == errno.ENOMEM:
            _end_without_memory(error)
        said = f"flexura: {error.filename or 'standard output'}: {error.strerror or error}"
        typer.echo(printable(said), err=True)
        _end(2 if error.errno == errno.ENAMETOOLONG else 1)  # no such file can be there
    except Exception as error:
        if isinstance(error, MemoryError) or any(text in str(error) for text in SHORT_OF_MEMORY):
            _end_without_memory(error)
        if not isinstance(error, FlexuraError):
            if not _interrupted.is_set():
                raise
            _end_interrupted()
        typer.echo(f"flexura: {error}", err=True)
        _end(2 if isinstance(error, InputError) else 1)


def _refuse_empty(words: list[str]) -> None:
    """An empty text is no file and no folder: a variable of a script may not be set."""
    for before, word in zip(["flexura", *words], words, strict=False):
        if not word and before != "--title":
            raise InputError("an empty argument: expected a file, a name or a value", key=before)


def _open_closed_streams() -> None:
    """Streams that a service or `>&-` closed lead nowhere: no file of ours gets their number."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, os.O_RDWR)
            os.set_inheritable(handle, handle == number)
            setattr(sys, name, os.fdopen(handle, "w" if number else "r", encoding="utf-8"))


_interrupted = threading.Event()  # compiled libraries turn Ctrl-C into errors of their own


def _interrupt(number: int, frame: FrameType | None) -> None:
    _interrupted.set()
    signal.default_int_handler(number, frame)


def _unraisable(what: Any) -> None:
    """An interrupt that compiled code could not pass on comes again, a moment later."""
    if issubclass(what.exc_type, KeyboardInterrupt):
        again = threading.Timer(0.01, _thread.interrupt_main)
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(what)


def _end(status: int) -> NoReturn:
    """End with a status; what fails after an interrupt was interrupted."""
    if status == 1 and _interrupted.is_set():
        _end_interrupted()
    sys.exit(status)


def _end_interrupted() -> NoReturn:
    typer.echo("flexura: interrupted", err=True)
    sys.exit(130)


def _end_without_memory(error: Exception) -> NoReturn:
    short = error if isinstance(error, MemoryError) else MemoryError(str(error).splitlines()[0])
    typer.echo(f"flexura: {out_of_memory(short)}", err=True)
    sys.exit(1)


if __name__ == "__main__":
    main()
