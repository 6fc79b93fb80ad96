"""Tries generated robots of some seeds, and prints how they ended.

    PYTHONPATH=tests/support python -m generators FIRST COUNT [--odd]

FIRST and COUNT are seeds; --odd makes one number of each robot as many as nine orders of magnitude
off. What is wrong is printed with its seed when it is found; `trial(seed, odd)` repeats it.
"""

from __future__ import annotations

import argparse

from .trial import Count, trial


def main() -> int:
    parser = argparse.ArgumentParser(prog="generators", description=__doc__.splitlines()[0])
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--odd", action="store_true")
    asked = parser.parse_args()
    total = Count()
    for seed in range(asked.first, asked.first + asked.count):
        found = trial(seed, asked.odd)
        for text in found.wrong:
            print(f"WRONG {text}", flush=True)
        total.add(found)
        if (seed - asked.first) % 500 == 499:
            print(f"up to seed {seed}: {total}", flush=True)
    print(total)
    return 1 if total.wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
