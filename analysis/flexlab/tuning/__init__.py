"""Tuning of controllers: gains found by evolution on the compiled simulator, for one objective."""
