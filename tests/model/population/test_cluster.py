"""Populations on a real Dask scheduler with worker processes of its own, one of which is killed
half-way."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest

import flexura as fx
from populations import ARM, DRIVE, no_number, same

pytest_plugins = ["dask_cluster"]
T = np.linspace(0.0, 2.0, 21)
BATCH = fx.Batch.vary(ARM, {"payload.mass_kg": np.linspace(0, 0.1, 400)})


def ready(address: str, workers: int) -> None:
    from distributed import Client

    until = time.monotonic() + 60
    while True:
        try:
            with Client(address, timeout=5, set_as_default=False) as client:
                client.wait_for_workers(workers, timeout=60)
            return
        except OSError:
            if time.monotonic() > until:
                raise


def test_a_killed_worker_loses_nothing_and_counts_nothing_twice(cluster, tmp_path):
    """Every robot once, and the bits of the same call without a cluster."""
    address, workers = cluster
    ready(address, 2)
    seen: list[float] = []

    def progress(fraction: float) -> None:
        seen.append(fraction)
        if len(seen) == 8:
            workers[0].send_signal(signal.SIGKILL)

    done = fx.simulate(
        BATCH,
        T,
        DRIVE,
        rtol=1e-9,
        folder=tmp_path / "there",
        chunk=10,
        progress=progress,
        scheduler=address,
    )
    assert workers[0].wait(10) == -signal.SIGKILL and workers[1].poll() is None
    assert (
        done.complete
        and list(done.robots) == list(range(1, 401))
        and len(seen) == 40
        and seen[-1] == 1.0
    )
    here = fx.simulate(BATCH, T, DRIVE, rtol=1e-9, folder=tmp_path / "here", chunk=10)
    assert same(done, here) and list(done.status) == ["done"] * 400
    names = [path.name for path in sorted((tmp_path / "here").iterdir())]
    assert names == [path.name for path in sorted((tmp_path / "there").iterdir())]
    assert all(
        (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()
        for name in names
    )


def test_a_cluster_goes_on_with_a_folder_that_was_begun_here(cluster, tmp_path):
    address, _ = cluster
    ready(address, 1)

    def stop(fraction: float) -> None:
        if fraction > 0.3:
            raise KeyboardInterrupt

    part = fx.simulate(BATCH, T, DRIVE, folder=tmp_path, chunk=50, progress=stop)
    assert not part.complete and list(part.robots) == list(range(1, 151))
    whole = fx.simulate(BATCH, T, DRIVE, folder=tmp_path, chunk=50, scheduler=address)
    assert whole.complete and same(whole, fx.simulate(BATCH, T, DRIVE))


def test_an_interrupted_cluster_keeps_what_is_done(cluster):
    address, _ = cluster
    ready(address, 1)
    count = 0

    def stop(fraction: float) -> None:
        nonlocal count
        count += 1
        if count == 3:
            raise KeyboardInterrupt

    part = fx.simulate(BATCH, T, DRIVE, chunk=10, progress=stop, scheduler=address)
    assert not part.complete and len(part.robots) == 30 == len(set(part.robots))


def test_what_is_wrong_on_a_worker_is_said_here(cluster):
    address, _ = cluster
    ready(address, 1)
    with pytest.raises(
        fx.InputError, match="number or a dictionary of numbers of robot 1"
    ) as raised:
        fx.simulate(fx.Batch.of([ARM]), T, DRIVE, reduce=no_number, scheduler=address)
    assert raised.value.key == "reduce"


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    monkeypatch.setattr("flexura.population.dask_cluster.CONNECT_S", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense://x"):
        with pytest.raises(
            fx.InputError, match="expected the address of a Dask scheduler"
        ) as raised:
            fx.simulate(BATCH, T, DRIVE, scheduler=address)
        assert raised.value.key == "scheduler"
