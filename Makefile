# Everything runs in a virtual environment of the project's own, made on first use. The targets types, current and site
# are parts of lint that run at the same time.
PYTHON  ?= python3
WORKERS ?= 2
VENV    := .venv
BIN     := $(VENV)/bin

# What pytest is told beside how many processes it has; test-all tells it more.
TESTS :=

# Machine code is kept in one folder, where modules with the same functions share it.
export NUMBA_CACHE_DIR ?= $(CURDIR)/$(VENV)/machine_code

# Python keeps what it compiles of the files that it imports, also where the environment tells it not to: the tests start
# hundreds of processes, and each would compile thousands of files again.
export PYTHONDONTWRITEBYTECODE :=

# The tests of what SymPy refuses expect its own integers, also where gmpy2 is installed, which mpmath then uses.
export SYMPY_GROUND_TYPES ?= python

.DEFAULT_GOAL := help
.PHONY: help demo test test-all lint types current site generate docs soak fuzz bench coverage mutate

help: ## show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/.run ## take the paper's Example 1 from a YAML file to digits, beside two integrators
	$(BIN)/python scripts/demo.py

test: $(VENV)/.dev ## run the tests of every change, some notebooks included
	$(BIN)/gqm warm --processes $(WORKERS)
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal $(TESTS)

test-all: TESTS := --extended
test-all: test ## run every test, with all cases, examples and notebooks

lint: $(VENV)/.dev ## check format, style, types and documentation, and that generated files are current
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(MAKE) --no-print-directory --jobs $(WORKERS) types current site

types:
	$(BIN)/mypy

current:
	$(BIN)/gqm-gen --check --quiet -o generated curves/*.yaml
	$(BIN)/python scripts/make_family_pages.py --check

site:
	$(BIN)/python -m sphinx -W --keep-going --quiet -D nb_execution_mode=off -b html docs docs/_build/lint

generate: $(VENV)/.dev ## write generated/ afresh from curves/, and the pages made from the code
	$(BIN)/gqm-gen --quiet -o generated curves/*.yaml
	$(BIN)/python scripts/make_family_pages.py
	$(BIN)/python docs/made.py

docs: $(VENV)/.docs ## build the documentation into docs/_build/html; a warning is an error
	$(BIN)/python -m sphinx -W --keep-going --quiet -b html docs docs/_build/html
	@echo "open docs/_build/html/index.html"

soak: $(VENV)/.run ## solve random launches and hold each motion to its laws and bounds (COUNT, BOUNDS, KINDS, SWEEPS, GRADIENTS, SEED)
	$(BIN)/python scripts/soak.py $(or $(COUNT),100000) $(or $(SEED),0)
	$(BIN)/python scripts/soak_bounds.py $(or $(BOUNDS),10000) $(or $(SEED),0)
	$(BIN)/python scripts/soak_kinds.py $(or $(KINDS),10000) $(or $(SEED),0)
	$(BIN)/python scripts/soak_sweeps.py $(or $(SWEEPS),100) $(or $(SEED),0)
	$(BIN)/python scripts/soak_gradients.py $(or $(GRADIENTS),30) $(or $(SEED),0)

fuzz: $(VENV)/.run ## read mutated files and expressions for ten minutes (SECONDS, SEED)
	$(BIN)/python scripts/fuzz.py $(or $(SECONDS),600) $(or $(SEED),0)

coverage: $(VENV)/.dev ## measure which branches the tests run, compiled code included; it takes most of an hour
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'coverage>=7.10'
	rm -rf .mutants/cache .mutants/coverage.compiled*
	WORKERS=$(WORKERS) $(BIN)/python scripts/mutate.py 0
	-NUMBA_CACHE_DIR=$(CURDIR)/.mutants/cache $(BIN)/python -m coverage run -m pytest -n $(WORKERS) --extended tests
	$(BIN)/python -m coverage combine --quiet --keep --data-file=.mutants/all .mutants/coverage.*
	$(BIN)/python -m coverage report --data-file=.mutants/all --skip-covered --show-missing
	$(BIN)/python -m coverage json --quiet --data-file=.mutants/all -o .mutants/all.json
	$(BIN)/python -c "import json; t = json.load(open('.mutants/all.json'))['totals']; print(t['covered_branches'], 'of', t['num_branches'], 'branches')"

mutate: $(VENV)/.dev ## change the code at random and list the changes that no test notices (COUNT, SEED)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'coverage>=7.10'
	WORKERS=$(WORKERS) $(BIN)/python scripts/mutate.py $(or $(COUNT),300) $(or $(SEED),0)

bench: $(VENV)/.bench ## time each stage, and set accuracy and time beside the alternatives' (docs/benchmarks.md)
	$(BIN)/gqm warm
	$(BIN)/python benchmarks/stages.py
	$(BIN)/python benchmarks/scale.py
	$(BIN)/python benchmarks/comparison.py
	-$(BIN)/python benchmarks/matrix.py
	-$(BIN)/python benchmarks/routes.py

# uv needs a quarter of the time of pip, which does its work where uv cannot. Python compiles the files that it imports;
# to compile all that is installed, most of which nothing here imports, would take longer.
comma := ,
define install
$(BIN)/uv pip install --quiet --python $(BIN)/python $(1) || \
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile $(1)
endef

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile uv

$(VENV)/.run: pyproject.toml | $(BIN)/python
	$(call install,--editable .)
	touch $@

$(VENV)/.bench: $(VENV)/.run
	$(call install,--editable '.[bench$(comma)plot]')
	-$(call install,--editable '.[peers]')
	touch $@

# What it installs holds all that .run does, which is therefore made with it.
$(VENV)/.dev: pyproject.toml | $(BIN)/python
	$(call install,--editable '.[dev]')
	touch $(VENV)/.run $@

$(VENV)/.docs: $(VENV)/.run
	$(call install,--editable '.[docs]')
	touch $@
