"""Speed and accuracy of the solver: `make bench`, or python -m flexlab.benchmarks.

`problems` has the motions, statics, frequencies and the error measure; `exudyn_programs` the same
in Exudyn; `native` runs of flexura. `exudyn_search` finds Exudyn's cheapest settings and keeps them
in settings.json; `native_search` finds flexura's. `equal_error` makes the rows, `timing` measures,
`report` makes the tables. `accuracy` gives errors over tolerances, `time_parts` what the time goes
into; `population` and `scaling` stand alone, as do `predictive`, `learning` and `board_load` of
`problems`.
"""

import os

for _library in ("OPENBLAS", "OMP", "MKL"):  # one thread: processor time is compared
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
