"""A run in other programs' formats, with its units and metadata: CSV, Parquet, TDMS (LabVIEW), MCAP
(ROS 2, Foxglove)."""
