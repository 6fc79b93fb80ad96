"""A run in other programs' formats, all numbers, units and metadata with it: CSV, Parquet, TDMS (LabVIEW), MCAP (Foxglove, ROS)."""
