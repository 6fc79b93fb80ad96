"""Tuning of controllers: gains found by evolution on the compiled simulator, judged by one
objective."""
