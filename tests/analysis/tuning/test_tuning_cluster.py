"""A search on a real Dask scheduler: the same bits as here, also when a worker dies on the way."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest

from flexlab.tuning import executor as engines
from flexlab.tuning.executor import DaskExecutor, ThreadExecutor
from flexlab.tuning.history import History
from flexlab.tuning.search import Search, search
from flexura.errors import InputError
from tunings import task

pytest_plugins = ["dask_cluster"]


def connected(one, address: str) -> DaskExecutor:
    until = time.monotonic() + 60
    while True:
        try:
            make_executor = DaskExecutor(one, address)
            make_executor.client.wait_for_workers(2, timeout=60)
            return make_executor
        except InputError:
            if time.monotonic() > until:
                raise


def test_a_cluster_gives_the_same_bits_and_survives_a_worker(cluster):
    one, how = task(), Search("ga", population=12, generations=6, seed=4)
    address, workers = cluster
    here, there = History(""), History("")
    with ThreadExecutor(one, 1) as make_executor:
        assert search(one, how, make_executor, here, lambda h: None)

    def kill(history: History) -> None:
        if len(history) == 2:
            workers[0].send_signal(signal.SIGKILL)

    with connected(one, address) as make_executor:
        assert search(one, how, make_executor, there, kill)
    for name in ("points", "goals", "figures", "reached"):
        assert np.array_equal(here.all(name), there.all(name), equal_nan=True)


def test_no_scheduler_there(monkeypatch):
    monkeypatch.setattr(engines, "CONNECT_S", 1)
    with pytest.raises(InputError, match="Dask scheduler"):
        DaskExecutor(task(), "tcp://127.0.0.1:1")
