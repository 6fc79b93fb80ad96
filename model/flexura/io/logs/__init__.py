"""Logs of other programs, read as Runs: CSV, LVM, TDMS, MAT, HDF5, MCAP, Parquet, bags of ROS."""

from .damage import digest
from .log import Clock, Column, Log
from .mapping import Map, Source, read_map
from .read import read_log
from .selection import Taken, Understood, understood

__all__ = [
    "Clock",
    "Column",
    "Log",
    "Map",
    "Source",
    "Taken",
    "Understood",
    "digest",
    "read_log",
    "read_map",
    "understood",
]
