"""How fast and how accurate the solver is: `make bench`, or python -m flexlab.benchmarks.

What stands where: `problems` (motions, statics, frequencies, and the error measure),
`exudyn_programs` (the same in Exudyn), `native` (runs of flexura), `search` (Exudyn's cheapest
settings, kept in settings.json), `choose` (flexura's), `timing`, `measure` (rows), `report`
(tables), `accuracy` (errors over tolerances), `population`, `growth`, `board_load`.
"""

import os

for _library in ("OPENBLAS", "OMP", "MKL"):  # one thread: processor time is compared
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
