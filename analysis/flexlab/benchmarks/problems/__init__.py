"""The benchmark's problems: robots, signals, motions, statics, frequencies, error measure."""
