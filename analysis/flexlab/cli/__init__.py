"""The command `flexura`: a file for each of its commands."""
