"""The command `flexura` in this process, its examples, and the tables that it draws."""

import contextlib
import io
import re
import sys

import typer

from flexlab.cli import app as cli
from flexlab.runs.table import Table


def run(arguments):
    """Status, stdout, stderr of `flexura ARGUMENTS`; an exception that is not caught comes out."""
    out, err = io.StringIO(), io.StringIO()
    before = sys.argv
    sys.argv = ["flexura", *map(str, arguments)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                cli.main()
                status = 0
            except SystemExit as end:
                status = end.code or 0
    finally:
        sys.argv = before
    return status, out.getvalue(), err.getvalue()


def commands():
    """Every command, those of a group too: its words, and its click command."""
    group = typer.main.get_command(cli.app)
    for name in group.list_commands(None):
        command = group.get_command(None, name)
        inner = getattr(command, "commands", None)
        if inner:
            yield from (((name, word), each) for word, each in inner.items())
        else:
            yield (name,), command


def examples(command):
    """The examples in a command's help, each in one line."""
    found = re.findall(r"Example: (flexura .*(?:\n +.*)*)", command.help or "")
    return [" ".join(text.split()) for text in found]


@contextlib.contextmanager
def drawn():
    """The tables that are drawn meanwhile."""
    tables, draw = [], Table.__rich_console__

    def recorded(self, console, options):
        tables.append(self)
        return draw(self, console, options)

    Table.__rich_console__ = recorded
    try:
        yield tables
    finally:
        Table.__rich_console__ = draw
