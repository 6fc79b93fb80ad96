"""The same problems as programs of Exudyn, built without flexura's code."""
