# Everything runs in a virtual environment of the project's own, made on first use.
PYTHON  ?= python3
WORKERS ?= 2
VENV    := .venv
BIN     := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help demo test lint generate bench

help: ## show this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/.run ## take the paper's Example 1 from a YAML file to digits, beside two integrators
	$(BIN)/python scripts/demo.py

test: $(VENV)/.dev ## run every test, notebooks included
	$(BIN)/python -m pytest -n $(WORKERS)

lint: $(VENV)/.dev ## check format, style and types, and that generated/ is current
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/gqm-gen --check --quiet -o generated curves/*.yaml

generate: $(VENV)/.dev ## write generated/ afresh from curves/
	$(BIN)/gqm-gen --quiet -o generated curves/*.yaml

bench: $(VENV)/.run ## time each stage, from derivation to a warm solve
	$(BIN)/python benchmarks/stages.py

$(VENV)/.run: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	touch $@

$(VENV)/.dev: $(VENV)/.run
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	touch $@
