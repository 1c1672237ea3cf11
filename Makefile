# Every target does its own set-up; PYTHON picks the interpreter for the virtual environment.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help ant test check tests format bench wheel clean

help: ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

ant: $(VENV)/installed ## train ExNEAT on Ant (a few minutes) and say what was learned
	@$(BIN)/exneat train task=ant geometry=all budget=quick resume=true

test: check tests ## checks and tests

check: $(VENV)/installed ## style, imports and types
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

tests: $(VENV)/installed ## tests alone
	$(BIN)/pytest

format: $(VENV)/installed ## bring the code into shape
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

bench: $(VENV)/installed ## how fast it is, as ratios (a few minutes on an idle machine)
	$(BIN)/python -m tests.bench

wheel: $(VENV)/installed ## build the wheel into dist/
	$(BIN)/python -m build --wheel

clean: ## remove what was built, but no runs
	rm -rf $(VENV) dist build .mypy_cache .ruff_cache .pytest_cache .hypothesis
