"""A run in other programs' formats, with its units and metadata: CSV, Parquet, MAT (MATLAB,
Octave), TDMS (LabVIEW), MCAP (ROS 2, Foxglove); the table of a population."""
