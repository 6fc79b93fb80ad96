# Every target sets up what it needs, once: .venv, Python packages, and system packages where apt is at hand.
# make PYTHON=/path/to/python3.12 setup     chooses the Python that .venv is made with
# make JOBS=8 test                          runs that many tests at a time

PYTHON ?= python3
JOBS   ?= 2

VENV     := .venv
PYTHON_FILES := model analysis firmware tests tools examples
READY    := $(VENV)/.ready
CORE     := $(VENV)/.core

# An environment knows the place of its checkout: after a move, or when its Python is gone, it is made anew.
ifneq ($(shell test -x $(VENV)/bin/python && cat $(READY) 2>/dev/null),$(CURDIR))
.PHONY: $(READY)
endif

.PHONY: help setup demo test check quick lint types tests core core-sanitize test-slow test-long docs bench wheel release lock licences firmware flash clean

help:
	@echo "make demo       simulate the rig, cross-check it, and leave a review to look at"
	@echo "make test       style, types and the quick tests ('make check' is the same)"
	@echo "make quick      style, types and a choice of tests in less than a minute, before each commit"
	@echo "make test-slow  the tests that take longer"
	@echo "make test-long  those that take hours; make test-long TESTS=tests/model/core/test_chains.py runs one part"
	@echo "make core       only the C++ tests of the core; make core-sanitize the same, with memory and arithmetic watched"
	@echo "make docs       this project's documentation as a site, in build/docs"
	@echo "make bench      how fast the solver is on this machine, and how busy the board"
	@echo "make wheel      a wheel that needs no compiler, in dist"
	@echo "make release    wheel, sources, bill of materials and their SHA-256 in dist: the same bytes each time"
	@echo "make licences   the packages that the project uses, with their licences"
	@echo "make lock       constraints.txt anew; make lock LOCK=--upgrade takes newer versions"
	@echo "make firmware   build the board's program; its ELF file is named at the end"
	@echo "make flash      build it and load it into the board: make flash PORT=/dev/ttyACM0 CONFIGURE=1"
	@echo "make setup      only the setting up, which every target does by itself"
	@echo "make clean      remove caches and builds; keeps $(VENV) and logs"

setup: $(CORE)
	@echo "ready: $(CURDIR)/$(VENV)"

$(READY): pyproject.toml constraints.txt tools/setup.py
	@command -v "$(PYTHON)" >/dev/null || { echo "Python 3.11 or newer is missing; on Debian type: apt-get install python3 python3-venv" >&2; exit 1; }
	@"$(PYTHON)" tools/setup.py

# Folders stand in the list too: their time changes when a file comes or goes.
$(CORE): $(READY) CMakeLists.txt $(shell find model/core model/fmi)
	@$(VENV)/bin/python tools/setup.py core

demo: $(CORE)
	@$(VENV)/bin/flexura demo

test check: lint types core tests

lint: $(READY)
	@$(VENV)/bin/ruff check $(PYTHON_FILES)
	@$(VENV)/bin/ruff format --check --quiet $(PYTHON_FILES)
	@git ls-files '*.cpp' '*.hpp' '*.h' '*.c' 2>/dev/null | xargs -r $(VENV)/bin/clang-format --dry-run -Werror

# The files that are quick and look at much; tests/test_setup.py holds that they are there.
QUICK := tests/test_setup.py tests/model/io/test_formats.py tests/model/io/test_shipped.py tests/model/test_optional.py \
  tests/model/io/test_run.py tests/model/signals/test_shaping.py tests/model/system tests/model/link \
  tests/docs/test_equations.py

quick: lint types $(CORE)
	@$(VENV)/bin/pytest -q -n $(JOBS) -m "not slow and not long" $(QUICK)

types: $(READY)
	@$(VENV)/bin/mypy

tests: $(CORE)
	@$(VENV)/bin/pytest -n $(JOBS) -m "not slow and not long"

core: $(CORE)
	@$(VENV)/bin/cmake --build build/core --target core_tests --parallel $(JOBS)
	@$(VENV)/bin/ctest --test-dir build/core --parallel $(JOBS) --output-on-failure

core-sanitize: $(READY)
	@$(VENV)/bin/cmake -S . -B build/sanitize -G Ninja -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(VENV)/bin/ninja -DFLEXURA_SANITIZE=ON -DFLEXURA_STRICT=ON
	@$(VENV)/bin/cmake --build build/sanitize --parallel $(JOBS)
	@$(VENV)/bin/ctest --test-dir build/sanitize --parallel $(JOBS) --output-on-failure

test-slow: $(CORE)
	@$(VENV)/bin/pytest -n $(JOBS) -m "slow and not long"

test-long: $(CORE)
	@$(VENV)/bin/pytest -m long $(TESTS)

# A name that leads nowhere ends it.
docs: $(CORE)
	@$(VENV)/bin/python -m sphinx -W --keep-going -q -b html docs build/docs
	@echo "open $(CURDIR)/build/docs/index.html"

# make bench BENCH="type4 pendulum --rounds 3" times a few problems; BENCH=--help says what there is.
bench: $(CORE)
	@$(VENV)/bin/python -m flexlab.benchmarks $(BENCH)

# For this machine's Python and processor. On Linux it takes the manylinux tag that its libraries allow; `cibuildwheel` makes those of
# all Pythons (pyproject.toml), in containers with old libraries.
wheel: $(READY)
	@$(VENV)/bin/python tools/wheel.py

release: $(READY)
	@$(VENV)/bin/python tools/release.py

licences: $(READY)
	@$(VENV)/bin/python tools/packages.py licences

lock: $(READY)
	@$(VENV)/bin/python tools/packages.py lock $(LOCK)

# make flash PORT=/dev/ttyACM0, or without PORT the one Mega 2560 that is plugged in; CONFIGURE=1 writes the rig's constants too.
flash: $(CORE)
	@$(VENV)/bin/flexura flash $(if $(PORT),--port $(PORT)) $(if $(CONFIGURE),--configure)

firmware: $(READY)
	@$(VENV)/bin/python firmware/protocol.py
	@$(VENV)/bin/python firmware/build.py

clean:
	rm -rf build dist *.egg-info .hypothesis .mypy_cache .pytest_cache .ruff_cache solution $(CORE) model/flexura/*.so
	find model analysis tests tools -name __pycache__ -prune -exec rm -rf {} +
