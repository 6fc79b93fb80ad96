"""Many robots: batches, chunks, threads, a Dask cluster, and restart."""

from .batch import Batch
from .population import Population, simulate
from .request import program
from .worker import cores

__all__ = ["Batch", "Population", "cores", "program", "simulate"]
