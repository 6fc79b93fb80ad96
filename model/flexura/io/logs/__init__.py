"""Logs of other programs, read as Runs: CSV, LVM, TDMS, MAT, HDF5, MCAP, Parquet, bags of ROS."""

from .damage import digest
from .log import Clock, Column, Log
from .mapping import Map, Source, read_map
from .names import TIMES
from .read import read_log
from .selection import Taken, Understood, understood
from .timebase import in_time

__all__ = [
    "TIMES",
    "Clock",
    "Column",
    "Log",
    "Map",
    "Source",
    "Taken",
    "Understood",
    "digest",
    "in_time",
    "read_log",
    "read_map",
    "understood",
]
