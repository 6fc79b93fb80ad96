"""Parameters of any robot, fitted to runs: least squares of channels, with intervals."""
