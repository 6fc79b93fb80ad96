"""Commands that are disturbed: files that fail, memory that is short, signals, lost power."""
