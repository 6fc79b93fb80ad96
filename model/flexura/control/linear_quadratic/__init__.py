"""Linear quadratic designs: regulators, estimators, and what their loops bear."""
