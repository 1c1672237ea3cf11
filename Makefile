# Every target does its own set-up; PYTHON picks the interpreter for the virtual environment.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.DEFAULT_GOAL := help
.PHONY: help ant walking.gif test check tests docs format reproduce report bench equivalence torture wheel clean

# Reports take the largest budget that has runs unless BUDGET is given.
OF_BUDGET := $(if $(BUDGET),budget=$(BUDGET))
BUDGET ?= quick
# true: each finished run's row goes into experiments/results.
PUBLISH ?= false
EXPERIMENTS := track_maze general_maze foraging hunting ant
# One run per core, each on one thread: evolution itself is serial.
WORKERS ?= $(shell getconf _NPROCESSORS_ONLN)
SIDE_BY_SIDE := hydra/launcher=joblib hydra.launcher.n_jobs=$(WORKERS) executor=serial

help: ## list the targets
	@grep -hE '^[a-z%][a-z% -]*:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 20

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

ant: $(VENV)/installed ## train ExNEAT on Ant (a few minutes) and say what was learned
	@$(BIN)/exneat train task=ant geometry=auto resume=true

test: check docs tests ## checks, manual and tests

check: $(VENV)/installed ## style, imports and types
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

tests: $(VENV)/installed ## tests alone
	$(BIN)/pytest -n 2 --dist loadfile

docs: $(VENV)/installed ## build the manual into docs/_build/html, with the results as published; a warning is an error
	$(BIN)/python docs/make_results.py
	$(BIN)/sphinx-build -q -W --keep-going -n -b html docs docs/_build/html

format: $(VENV)/installed ## bring the code into shape
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

sweep-%: $(VENV)/installed ## all runs of one experiment that are missing, e.g. make sweep-ant BUDGET=paper PUBLISH=true
	$(BIN)/exneat sweep experiment=$* budget=$(BUDGET) publish=$(PUBLISH) $(SIDE_BY_SIDE)

reproduce: $(VENV)/installed ## do the missing runs of all experiments, then report: make reproduce BUDGET=quick|paper
	@status=0; for experiment in $(EXPERIMENTS); do $(MAKE) --no-print-directory sweep-$$experiment || status=1; done; \
	$(BIN)/exneat report budget=$(BUDGET) && exit $$status

walking.gif: $(VENV)/installed ## five seconds of a champion for the README, at most 3 MB: make walking.gif RUN=outputs/ant/<run>
	@test -n "$(RUN)" || { echo "RUN=outputs/ant/<run> names the run"; exit 2; }
	$(BIN)/exneat watch run=$(RUN) format=gif steps=100 width=360 height=270 output=docs/images/walking.gif
	@test $$(wc -c < docs/images/walking.gif) -le 3000000 || { echo "docs/images/walking.gif is above 3 MB"; exit 1; }

report: $(VENV)/installed ## every table and figure from the existing runs; trains nothing
	$(BIN)/exneat report $(OF_BUDGET)

figure-%: $(VENV)/installed ## one figure, e.g. make figure-4.3
	$(BIN)/exneat report only=$@ $(OF_BUDGET)

table-%: $(VENV)/installed ## one table, e.g. make table-5.5
	$(BIN)/exneat report only=$@ $(OF_BUDGET)

bench: $(VENV)/installed ## how fast it is, as ratios, in five parts (several minutes on an idle machine)
	$(BIN)/python -m tests.bench

equivalence: $(VENV)/installed ## whether array genomes evolve as well as neat-python's own (some twenty minutes)
	$(BIN)/python -m tests.equivalence

torture: $(VENV)/installed ## kills, full disks, damage, races and signals, against their bars (about an hour on an idle machine)
	$(BIN)/python -m tests.torture

wheel: $(VENV)/installed ## build the wheel into dist/
	$(BIN)/python -m build --wheel

clean: ## remove what was built, but no runs
	rm -rf $(VENV) dist build docs/_build .mypy_cache .ruff_cache .pytest_cache .hypothesis
