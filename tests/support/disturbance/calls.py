"""Every command that keeps something: a small call of it, what it makes, and what it needs."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .programs import Ended, Program

LAW = ["rig", "rig-inverse-law"]
TUNE = ["tune", "rig", "rig-step", "--controller", "rig", "--rig", "rig", "--jobs", "1"]
TUNE += ["--free", "kp_1_V_m=100:10000", "--population", "4", "--generations", "2"]
STUDY = ["study", "payload", "type-1-rr", "type-1-bang-bang", "--values", "0:0.2:3", "--jobs", "1"]
VARY = ["simulate", *LAW, "--vary", "payload.mass_kg=0:0.1:3"]


@dataclass(frozen=True)
class Command:
    """A call of `flexura`.

    `out`: what it makes, below the working folder; `force`: whether it can replace that;
    `resumes`: the same call goes on; `other`: arguments that change every number of the result.
    """

    arguments: list[Any]
    out: str
    force: bool = True
    resumes: bool = False
    other: tuple[str, ...] = ()
    firmware: bool = False

    def call(self, firmware: Path | None = None) -> list[Any]:
        return [*self.arguments, *(("--firmware", firmware) if self.firmware else ())]


COMMANDS = {
    "simulate": Command(["simulate", *LAW, "--out", "out"], "out", other=("--rtol", "1e-4")),
    "simulate --vary": Command([*VARY, "--out", "out"], "out", False, True),
    "inverse": Command(["inverse", *LAW, "--out", "out"], "out"),
    "crosscheck": Command(["crosscheck", *LAW, "--out", "out"], "out", other=("--rtol", "1e-4")),
    "study": Command([*STUDY, "--out", "out"], "out", other=("--rtol", "1e-4")),
    "tune": Command([*TUNE, "--out", "out"], "out", False, True),
    "compare": Command(["compare", "a", "b", "--out", "out"], "out"),
    "review": Command(["review", "a", "--save", "out.rrd"], "out.rrd"),
    "plot": Command(["plot", "a", "--out", "out.png"], "out.png"),
    "animate": Command(["animate", "a", "--out", "out.gif"], "out.gif"),
    "export csv": Command(["export", "a", "--to", "csv", "--out", "out.csv"], "out.csv"),
    "export mat": Command(["export", "a", "--to", "mat", "--out", "out.mat"], "out.mat"),
    "export tdms": Command(["export", "a", "--to", "tdms", "--out", "out.tdms"], "out.tdms"),
    "export mcap": Command(["export", "a", "--to", "mcap", "--out", "out.mcap"], "out.mcap"),
    "export parquet": Command(
        ["export", "a", "--to", "parquet", "--out", "out.parquet"], "out.parquet"
    ),
    "export population": Command(["export", "p", "--to", "csv", "--out", "out.csv"], "out.csv"),
    "new": Command(["new", "out.toml"], "out.toml"),
    "migrate": Command(["migrate", "out.toml"], "out.toml", False),
    "bench step": Command(
        ["bench", "step", "--duration-s", "0.9", "--emulated", "--out", "out"],
        "out",
        False,
        firmware=True,
    ),
    "bench calibrate": Command(
        ["bench", "calibrate", "--emulated", "--out", "out", "--tips-mm=-20,-12,-4,4,12,20"],
        "out",
        False,
        firmware=True,
    ),
    "identify": Command(["identify", "e", "--out", "out.toml"], "out.toml"),
}


class Place:
    """A working folder with finished results `a`, `b`, `p`, `e`, from which it is made anew."""

    def __init__(self, program: Program, folder: Path, firmware: Path | None = None) -> None:
        self.program, self.folder, self.firmware = program, folder, firmware
        self.kept = folder / "kept"
        self.kept.mkdir(parents=True)
        made = [
            ["simulate", *LAW, "--out", "a"],
            ["simulate", *LAW, "--out", "b", "--rtol", "1e-4"],
        ]
        made.append([*VARY, "--out", "p"])
        for arguments in made:
            ended = program.run(arguments, self.kept)
            assert ended.status == 0, ended.err

    def with_experiment(self) -> None:
        """An emulated experiment `e` for `identify`; it takes some seconds."""
        if (self.kept / "e").exists():
            return
        call = ["bench", "excite", "--emulated", "--firmware", self.firmware, "--out", "e"]
        ended = self.program.run(call, self.kept)
        assert ended.status == 0, ended.err

    def fresh(self) -> Path:
        """A working folder with the inputs alone; an older robot file for `migrate`."""
        work = self.folder / "work"
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir()
        for each in self.kept.iterdir():
            (work / each.name).symlink_to(each)
        return work

    def old_robot(self, work: Path) -> None:
        """A robot file with keys of an older version, for `migrate`."""
        shipped = Path(__file__).resolve().parents[3] / "model" / "robots" / "single-r.toml"
        text = shipped.read_text().replace(
            "[link.joint]", "[link.joint]\nviscous_friction = 0.001", 1
        )
        (work / "out.toml").write_text(text)

    def run(self, command: Command, work: Path, *more: str, **disturbance: Any) -> Ended:
        """Run a command in a working folder."""
        return self.program.run([*command.call(self.firmware), *more], work, **disturbance)


def files(folder: Path) -> dict[str, bytes]:
    """The files below a folder, those behind links left out."""
    return {
        str(p.relative_to(folder)): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file() and not p.is_symlink()
    }
