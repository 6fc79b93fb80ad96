"""Many robots: batches, chunks, threads, a Dask cluster, and restart."""

from .batch import Batch
from .population import Population, simulate
from .request import program
from .store import is_population
from .worker import cores

__all__ = ["Batch", "Population", "cores", "is_population", "program", "simulate"]
