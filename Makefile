# `make help` lists the targets.
PYTHON ?= python3
CORES ?= 2
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed
export PYTHONHASHSEED := 0

.PHONY: help reproduce smoke publish test check format lock clean
.DEFAULT_GOAL := help

help:  ## list the targets
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

reproduce: $(INSTALLED)  ## install everything, then make every table (results/mini)
	$(BIN)/snakemake --cores $(CORES) all

smoke: $(INSTALLED)  ## every rule and every model at toy size (results/smoke)
	$(BIN)/snakemake --cores $(CORES) --configfile config/smoke.yaml -- all

publish: reproduce  ## make the tracked results anew, and the read-me's numbers from them
	$(BIN)/python -m synfeal.report.readme

test: check  ## static checks and the test suite
	$(BIN)/pytest

check: $(INSTALLED)  ## static checks alone: format, lint, types, workflow
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/mypy
	$(BIN)/python -m synfeal.config.docs --check
	$(BIN)/snakemake --lint

format: $(INSTALLED)  ## format the code in place
	$(BIN)/python -m synfeal.config.docs
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

lock: $(INSTALLED)  ## write the versions installed now to requirements.lock
	setup/lock.sh $(BIN)/python > requirements.lock.new
	mv requirements.lock.new requirements.lock

clean:  ## remove results of the smoke profile and caches
	rm -rf results/smoke .pytest_cache .mypy_cache .ruff_cache

$(INSTALLED): requirements.lock pyproject.toml setup/system_packages.sh
	setup/system_packages.sh $(PYTHON)
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@
