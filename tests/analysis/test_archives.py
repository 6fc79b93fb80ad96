"""Archives cannot lie: every byte of every kind is damaged, and no wrong number is read."""

import logging

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import archives
import flexura as fx
from flexura.io import seal

LARGE = {"review": 13}  # of 70 kB one byte of so many


@pytest.mark.parametrize("every", [83, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", archives.KINDS)
def test_every_flipped_byte_is_refused_or_said(kind, every, tmp_path, record_property):
    every *= LARGE.get(kind, 1)
    counts = archives.damaged(archives.KINDS[kind](tmp_path / kind), every)
    print(f"{kind}: {dict(counts)}")
    record_property("flips", dict(counts))
    assert counts["refused"] + counts["lost with a word"] == counts["flips"]
    assert counts["flips"] > counts["bytes"] / every and counts["bytes"] > 50
    assert kind == "events" or counts["refused"] == counts["flips"]


@pytest.mark.parametrize("kind", sorted(set(archives.KINDS) - {"events"}))
def test_a_shortened_or_lengthened_archive_is_refused_or_the_same(kind, tmp_path):
    archive = archives.KINDS[kind](tmp_path / kind)
    good, right = archive.file.read_bytes(), archives.same(archive.read())
    step = 41 * LARGE.get(kind, 1)
    for content in [
        *(good[:size] for size in range(0, len(good), step)),
        good + b"\0",
        good + good,
    ]:
        archive.file.write_bytes(content)
        try:
            found = archive.read()
        except fx.InputError as error:
            assert archive.file.name in str(error)
        except (pa.ArrowException, OSError):
            assert kind == "study"  # read here by pyarrow alone
        else:  # without its seal: as one of an older version
            assert archives.same(found) == right and kind == "search"


def test_a_damaged_chunk_is_made_again_with_the_same_bytes(tmp_path):
    archive = archives.chunk(tmp_path)
    good = archive.file.read_bytes()
    for at in range(0, len(good), 397):
        archive.file.write_bytes(good[:at] + bytes([good[at] ^ 4]) + good[at + 1 :])
        assert not fx.Population.read(tmp_path).complete
        assert archives.population(tmp_path).complete and archive.file.read_bytes() == good


def unsealed(file):
    """The file as an older version wrote it."""
    data = file.read_bytes()
    at = data.index(seal.BEGIN)
    file.write_bytes(data[:at] + data[at + seal.SIZE :])


@pytest.mark.parametrize("kind", ["run", "request", "search"])
def test_an_archive_of_an_older_version_is_read_with_one_line(kind, tmp_path, caplog):
    archive = archives.KINDS[kind](tmp_path / kind)
    right = archives.same(archive.read())
    assert not caplog.records
    unsealed(archive.file)
    with caplog.at_level(logging.WARNING, logger="flexura"):
        assert archives.same(archive.read()) == right
    assert [f"{archive.file}: of an older version" in r.message for r in caplog.records] == [True]


def test_a_recording_of_an_older_version_is_read(tmp_path):
    from flexlab.recordings import recording

    archive = archives.KINDS["events"](tmp_path)
    right = archive.read()
    lines = [line.partition(b" ")[2] for line in archive.file.read_bytes().splitlines()]
    archive.file.write_bytes(b"\n".join([*lines, b""]))
    unsealed(tmp_path / recording.SESSION)
    assert vars(archive.read()) == vars(right)


def test_other_programs_read_a_sealed_run(tmp_path):
    archive = archives.run(tmp_path)
    table = pq.read_table(archive.file, page_checksum_verification=True)
    assert np.array_equal(table["tip/x_m"], archive.read()["tip/x"])


def test_a_name_that_looks_like_a_seal_does_no_harm(tmp_path):
    text = (seal.BEGIN + b"0" * seal.DIGITS + seal.END).decode()
    made = fx.Run(archives.T, {}, {}, {"source": text, "robot": {"name": text[:20]}})
    made.save(tmp_path)
    assert fx.Run.read(tmp_path).meta == made.meta


@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    "every",
    [pytest.param(211, marks=pytest.mark.slow), pytest.param(1, marks=pytest.mark.long)],
)
def test_a_flipped_byte_of_what_a_board_sent_is_a_row_that_is_lost(every, tmp_path):
    """Each frame has its own checksum: a number is what was sent, or NaN, and the run says so."""
    from experiments import BENCH, SETTINGS, experiment
    from flexlab.experiment import plan as plans
    from flexlab.recordings import recording
    from flexlab.recordings.run_from_recording import run_from_recording

    whole = experiment(plans.free_vibration(BENCH, SETTINGS, 0.3, 1.05), tmp_path / "run").run
    file = tmp_path / "run" / recording.RECEIVED
    good, flips, unseen = file.read_bytes(), 0, 0
    for at in range(0, len(good), every):
        raw = bytearray(good)
        raw[at] ^= 1 << at // every % 8
        file.write_bytes(raw)
        run = run_from_recording(tmp_path / "run")
        same = equal_or_missing(run, whole)
        line = run.meta["line"]
        assert same or line["bad_frames"] or line["missing"] or len(run) < len(whole)
        flips, unseen = flips + 1, unseen + same
    print(f"received.bin: {len(good)} bytes, {flips} flips, {unseen} outside of the reports")


def equal_or_missing(run, whole):
    """Every number is that of the whole run, or missing; returns whether none is missing."""
    at = np.searchsorted(whole.t, run.t)
    assert np.array_equal(whole.t[at], run.t)
    for name in ("joint/1/position", "joint/2/position", "link/2/flex_voltage"):
        there = np.isfinite(run[name])
        assert np.array_equal(run[name][there], whole[name][at][there]), name
    return len(run) == len(whole) and bool(np.isfinite(run["joint/1/position"]).all())
