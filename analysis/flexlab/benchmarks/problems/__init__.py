"""The problems of the benchmarks: robots, signals, motions, statics and frequencies, and how
errors count."""
