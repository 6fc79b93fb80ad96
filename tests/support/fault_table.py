"""The fault matrix in firmware/README.md: `python tests/support/fault_table.py` measures and
writes it, a test compares."""

from __future__ import annotations

from pathlib import Path

from breakdowns import OTHERS
from faults import CASES, Row, measure
from flexlab.board.emulator.simulator import CLOCK_HZ
from flexlab.board.protocol.declaration import Fault

README = Path(__file__).resolve().parents[2] / "firmware" / "README.md"
BEGIN, END = "<!-- fault matrix: begin -->", "<!-- fault matrix: end -->"


def line(what: str, row: Row) -> str:
    after = "-" if row.after_detection is None else f"{1e6 * row.after_detection / CLOCK_HZ:.0f} us"
    fault = "none (Idle)" if row.fault is Fault.none else f"`{row.fault.name}`"
    return f"| {what} | {fault} | {1e3 * row.after_cause / CLOCK_HZ:.1f} ms | {after} |"


def agrees(what: str, row: Row, table: list[str]) -> bool:
    """Whether the table says this: the same fault, and times that a change of the firmware
    elsewhere may have moved a little, by a tick and a tenth, and by 0.1 ms within the tick."""
    now = line(what, row).split(" | ")
    for told in (old.split(" | ") for old in table):
        if told[0] == now[0]:
            times = [
                [float(cells[k].split()[0]) if cells[k][0] != "-" else 0.0 for cells in (told, now)]
                for k in (2, 3)
            ]
            near = (
                abs(times[0][0] - times[0][1]) <= 1.0 + 0.1 * times[0][1]
                and abs(times[1][0] - times[1][1]) <= 100
            )
            return told[1] == now[1] and near
    return False


def table_in_readme() -> list[str]:
    """The lines between the two markers."""
    return (
        README.read_text(encoding="utf-8")
        .partition(BEGIN)[2]
        .partition(END)[0]
        .strip()
        .splitlines()
    )


def write_table() -> None:
    """Measure all that can break with Debian's compiler, and put the table between the markers."""
    head, begin, rest = README.read_text(encoding="utf-8").partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not (begin and end):
        raise SystemExit(f"{README} has no {BEGIN} with {END} after it")
    rows = [line(case.what, measure(name, "debian")) for name, case in CASES.items()]
    rows += [line(other.what, other.measure("debian")) for other in OTHERS.values()]
    title = [
        "| what breaks | fault | outputs off after it | after the tick that detected it |",
        "| --- | --- | ---: | ---: |",
    ]
    README.write_text("\n".join([head + BEGIN, *title, *rows, END + tail]), encoding="utf-8")


if __name__ == "__main__":
    write_table()
