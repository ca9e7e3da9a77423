# Everything from a fresh clone: `make run`, `make test`. The environment is made where it is not there.
.DEFAULT_GOAL := run
.PHONY: run bench bench-gpu mutants faults test test-browser test-mujoco test-opensim test-slurm lint docs readme ui dashboard publish clean

PYTHON ?= python3
CORES ?= 2
VENV := .venv
BIN := $(VENV)/bin
export MLFLOW_DISABLE_TELEMETRY := true

run: $(VENV)/.ready ## the main job: every dataset, model, recipe and scale named in config.yaml
	$(BIN)/snakemake --cores $(CORES)

test: $(VENV)/.ready ## all tests that need nothing but Python
	$(BIN)/pytest -q -n $(CORES) --dist loadgroup

# Further tests with programs of Debian, installed where they are missing and one may; else they are skipped with a reason.
test-browser: $(VENV)/.ready ## what `make ui` and the report show, in a browser without a screen
	$(call install,/usr/bin/chromedriver,chromium chromium-driver)
	$(BIN)/pytest -q -rs -m browser

test-mujoco: $(VENV)/.ready ## arms that MuJoCo moves, of the study of verdicts
	$(BIN)/python -m pip install -q --target $(VENV)/mujoco --no-deps -r studies/verdicts/requirements.txt
	PYTHONPATH=$(VENV)/mujoco $(BIN)/pytest -q -m mujoco

test-opensim: $(VENV)/.ready ## muscle paths of an OpenSim model, with OpenSim itself
	$(BIN)/python -m pip install -q --no-deps --target $(VENV)/opensim opensim==4.6
	PYTHONPATH=$(VENV)/opensim $(BIN)/pytest -q -m opensim

test-slurm: $(VENV)/.ready ## the workflow on a SLURM of this one machine
	$(call install,/usr/sbin/slurmctld,slurm-wlm munge)
	$(BIN)/pytest -q -rs -m slurm

install = @test -e $(1) || { test "$$(id -u)" = 0 && apt-get update -qq && \
  DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $(2); } || echo "$(2) could not be installed"

bench: $(VENV)/.ready ## speeds beside the straightforward program, measured side by side, and how long a start takes
	$(BIN)/python benchmarks/dry_run.py
	$(BIN)/python benchmarks/learning.py
	$(BIN)/python benchmarks/diagnosis.py

faults: $(VENV)/.ready ## kill a small job at random moments, load it, fill its disk: nothing is lost and the results are the same
	$(BIN)/python tests/faults/attack.py

bench-gpu: $(VENV)/.ready ## the same training on a GPU and on one core
	$(BIN)/python benchmarks/gpu.py

mutants: $(VENV)/.ready ## put each deliberate fault of tests/faults/faults.yaml into a copy of the code and see its test fail
	$(BIN)/python tests/faults/replay.py

lint: $(VENV)/.ready ## style, layout and types of the Python code, layout of the rules
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/snakefmt --check Snakefile workflow/rules studies

docs: $(VENV)/.docs ## a site of all pages, effects, settings and commands, in docs/_build; it fails where a link leads nowhere
	$(BIN)/python docs/reference.py
	$(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build
	@echo "docs/_build/index.html"

readme: $(VENV)/.ready ## numbers and pictures of README and docs/ from results/, after `make run`
	$(BIN)/python -m docs.measured results

publish: $(VENV)/.ready ## rebuild the MLflow store from results/
	$(BIN)/snakemake --cores 1 publish

ui: $(VENV)/.ready ## browse the results at http://127.0.0.1:5000
	$(BIN)/myowave ui

SWEEP ?= $(firstword $(shell ls -t results/learning/*/*/*/*-scale/sweep/journal.log 2>/dev/null))
dashboard: $(VENV)/.ready ## browse the last sweep at http://127.0.0.1:8080; another: SWEEP=.../journal.log or a database
	@test -n "$(SWEEP)" || { echo "There is no sweep in results/ yet: snakemake sweep --cores 2"; exit 1; }
	$(BIN)/optuna-dashboard --host 127.0.0.1 --port 8080 "$(SWEEP)"

clean: ## remove the environment; results/ stays
	rm -rf $(VENV)

$(VENV)/.docs: $(VENV)/.ready docs/requirements.txt
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --root-user-action=ignore --require-hashes --no-deps -r docs/requirements.txt
	@touch $@

# The environment is finished only when .ready is there, so an interrupted installation starts again, from the beginning
# where pip is not there yet.
$(VENV)/.ready: environment.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "myowave needs Python 3.11 or newer, but '$(PYTHON)' is $$($(PYTHON) -V 2>&1)."; \
	  echo "Name another: make PYTHON=python3.12 run"; exit 1; }
	@echo "Setting up $(VENV) (once; a few minutes) ..."
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV) || { \
	  echo "Could not make $(VENV). On Debian or Ubuntu: apt-get install python3-venv"; rm -rf $(VENV); exit 1; }
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --root-user-action=ignore --require-hashes --no-deps -r environment.lock
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --root-user-action=ignore --no-build-isolation -e .
	@touch $@
