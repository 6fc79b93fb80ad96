"""Free vibration: frequency and damping of each mode, with intervals, and the shapers they ask
for."""
