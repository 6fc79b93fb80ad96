"""Results that replace others, where the file system refuses the n-th operation."""

import errno
import os

import pytest

from flexura.io import DRAFT, FINISHED, replace_results, settle

OLD = {"run": "old run", "picture": "old picture"}
NEW = {"run": "new run", "table": "new table"}


def put(folder, results):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in results.items():
        (folder / name).write_text(text)


def results(folder):
    return {p.name: p.read_text() for p in folder.iterdir() if p.is_file()}


@pytest.fixture(params=["once", "from then on"])
def refusal(request, monkeypatch):
    """A function: the n-th synchronisation or renaming fails, once or with all after it."""
    forever = request.param == "from then on"

    def refuse(n):
        calls = [0]

        def counted(real):
            def call(*arguments):
                calls[0] += 1
                if calls[0] == n or (forever and calls[0] > n):
                    raise OSError(errno.EIO, "Input/output error")
                return real(*arguments)

            return call

        for name in ("rename", "fsync"):
            monkeypatch.setattr(os, name, counted(getattr(os, name)))
        return calls

    return refuse, forever, monkeypatch


def test_the_old_results_or_the_new_ones_stand_whole(tmp_path, refusal):
    refuse, forever, monkeypatch = refusal
    told = 0
    for n in range(1, 100):
        folder = tmp_path / str(n)
        draft = folder / f"{DRAFT}draft"
        put(folder, OLD)
        put(draft, NEW)
        calls = refuse(n)
        error = None
        try:
            replace_results(draft, folder)
        except OSError as caught:
            error = caught
        monkeypatch.undo()
        if calls[0] < n:
            break
        assert error is not None and error.errno == errno.EIO
        waits = (folder / FINISHED).exists()
        assert waits == (FINISHED in error.strerror)
        assert forever or not waits
        told += waits
        settle(folder)
        assert results(folder) in (OLD, OLD | NEW)
        assert not waits or results(folder) == OLD | NEW
        assert not [p for p in folder.iterdir() if p.name.startswith(DRAFT) and p != draft]
    assert n == 9
    assert told == (6 if forever else 0)
