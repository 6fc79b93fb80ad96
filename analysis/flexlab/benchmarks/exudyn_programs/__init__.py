"""The benchmark's problems as programs of Exudyn, built without flexura's code."""
