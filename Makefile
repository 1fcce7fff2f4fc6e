# `make help` lists the targets.
PYTHON ?= python3
PROFILE ?= mini
CORES ?= 2
LOCK ?= requirements.lock
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed
SLURM_INSTALLED := $(VENV)/installed-slurm
QUALITY := $(VENV)/quality
DOCS := $(VENV)/docs
# Notebooks call `synfeal` by name.
SPHINX := PATH=$(abspath $(BIN)):$$PATH $(BIN)/sphinx-build -c docs/site -d build/doctrees
RUN := $(BIN)/synfeal run --cores $(CORES)
# `make real`: what is scanned, where its results go, and other labels of it (docs/real.md).
SEVEN_SCENES ?=
REAL_RESULTS ?= results/real
SFM_LABELS ?=
SEED ?= 101
# A file of tests to a worker: their fixtures are made once, and a worker has one thread.
PYTEST := OMP_NUM_THREADS=1 $(BIN)/pytest --numprocesses $(CORES) --dist loadfile
export PYTHONHASHSEED := 0
# Modules are compiled when they are first imported. Where this variable is set, as in some images,
# nothing of that is kept, and every job compiles a thousand modules again, half of its start.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: help reproduce smoke real start replicate publish archive plan test test-all test-slurm test-isolated coverage mutate check format lock wheels docs docs-links compile clean
.DEFAULT_GOAL := help

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

reproduce: $(INSTALLED)  ## install everything, then make every table (results/mini)
	$(RUN)

smoke: $(INSTALLED)  ## every rule and every model at toy size (results/smoke)
	$(RUN) --profile smoke

real: $(INSTALLED)  ## from a scan to real photographs: SEVEN_SCENES=path of a 7-Scenes scene (docs/real.md)
	PATH=$(abspath $(BIN)):$$PATH $(BIN)/snakemake --snakefile workflow/real/Snakefile --cores $(CORES) \
	  --config sequence=$(SEVEN_SCENES) results=$(REAL_RESULTS) "sfm_labels=$(SFM_LABELS)"

start: $(INSTALLED)  ## train the backbones anew that pretrained runs start from (docs/start.md)
	$(RUN) --profile start -- start
	$(BIN)/python -m baselines.localizers.backbones.shipped results/start

replicate: $(INSTALLED)  ## what is not archived yet of the replication with SEED, and its archive (docs/rules.md)
	set -e; for labels in exact estimated; do \
	  left=$$($(BIN)/python -m reproduction.replications remaining results/replication_$(SEED) --seed $(SEED) \
	    --labels $$labels); \
	  [ -z "$$left" ] || $(BIN)/snakemake --cores $(CORES) --configfile config/replication.yaml \
	    --config seed=$(SEED) profile=replication_$(SEED) -- $$left; \
	done
	$(BIN)/python -m reproduction.replications archive results/replication_$(SEED) --seed $(SEED)

publish: $(INSTALLED)  ## track what PROFILE's run made (results/published), and the pages' numbers from it
	$(BIN)/python -m reproduction.report.publish --profile $(PROFILE)
	$(BIN)/python -m reproduction.report.pages

archive: $(INSTALLED)  ## PROFILE's report, figures, and all that its tables are made from, in one file
	mkdir -p build
	tar --create --gzip --file build/results-$(PROFILE).tar.gz --directory results \
	  --owner 0 --group 0 --sort name --ignore-failed-read --exclude '.*' \
	  $(addprefix --exclude=,*.glb *.ply *.pt *.npz *.g2o errors.csv common_errors.csv) \
	  $(addprefix $(PROFILE)/,report.html summary.md claims.csv claim_effects.csv provenance.json benchmarks.csv) \
	  $(addprefix $(PROFILE)/,benchmarks tables figures labels estimates runs references scenes)
	@echo build/results-$(PROFILE).tar.gz

plan: smoke  ## what plans are worth: predictions beside measured runs (results/benchmarks)
	mkdir -p results/benchmarks/smoke && cp results/smoke/benchmarks.csv results/benchmarks/smoke/
	$(BIN)/synfeal cost --measured results/benchmarks/smoke results/published/night \
	  --compare results/published/mini --csv results/benchmarks/plan_check.csv

test: check  ## static checks and the test suite, but for what is slow, on CORES cores
	$(PYTEST) -m "not slow"

test-all: check  ## the same with what is slow, as continuous integration runs it once a week
	$(PYTEST)

test-slurm: $(SLURM_INSTALLED)  ## the smoke profile here and through a SLURM cluster of one node, which is killed
	setup/slurm_cluster.sh install
	$(BIN)/python -m tests.support.slurm_run --work results/slurm_test $(if $(LOCAL),--local $(LOCAL))
	$(BIN)/pytest tests/workflow/test_containers.py tests/workflow/test_slurm_run.py

test-isolated: $(SLURM_INSTALLED)  ## the smoke profile here, and with every job alone in an empty folder (docs/clusters.md)
	command -v rsync || apt-get install --yes --no-install-recommends rsync
	$(BIN)/snakemake --cores $(CORES) --configfile config/smoke.yaml -- all
	PATH=$(abspath $(BIN)):$$PATH $(BIN)/snakemake --profile workflow/profiles/isolated \
	  --default-storage-prefix $(abspath results/store) --configfile config/smoke.yaml -- all
	$(BIN)/python -m tests.support.slurm_run.trees results/smoke results/store/results/smoke

coverage: $(QUALITY)  ## which lines the test suite runs (results/benchmarks/coverage.md)
	$(BIN)/coverage erase
	OMP_NUM_THREADS=1 $(BIN)/coverage run -m pytest --numprocesses $(CORES) --dist loadfile
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --skip-covered --format markdown > results/benchmarks/coverage.md

mutate: $(QUALITY)  ## which deliberate defects the tests notice
	$(BIN)/mutmut run --max-children $(CORES)
	$(BIN)/mutmut results

check: $(INSTALLED)  ## static checks alone: format, lint, types, workflow
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m reproduction.design.docs --check
	$(BIN)/snakemake --lint

format: $(INSTALLED)  ## format the code in place
	$(BIN)/python -m reproduction.design.docs
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

lock: $(INSTALLED)  ## write the versions installed now to the lock files
	setup/lock.sh $(BIN)/python > requirements.lock.new
	mv requirements.lock.new requirements.lock
	setup/lock_cuda.sh $(BIN)/python > requirements-cuda.lock.new
	mv requirements-cuda.lock.new requirements-cuda.lock

wheels: $(INSTALLED)  ## sdists and wheels of the three distributions (build/dist)
	rm -rf build/dist
	for folder in . baselines reproduction; do \
	  $(BIN)/python -m build --no-isolation --outdir build/dist $$folder || exit 1; done

docs: $(DOCS)  ## the documentation site, its links checked (build/site)
	rm -rf build/site
	$(SPHINX) --fail-on-warning --keep-going --quiet . build/site
	$(BIN)/python docs/site/check.py build/site

docs-links: $(DOCS)  ## try the links that lead out of the documentation
	$(SPHINX) -b linkcheck --quiet . build/links

compile: $(INSTALLED)  ## compile all installed modules, for images that keep nothing compiled later
	@# Some packages have modules that this Python cannot read and nobody imports.
	-$(BIN)/python -m compileall -qq -j 0 $(VENV)/lib synfeal baselines reproduction workflow

clean:  ## remove results of the smoke profile and caches
	rm -rf results/smoke .pytest_cache .mypy_cache .ruff_cache

$(INSTALLED): $(LOCK) pyproject.toml baselines/pyproject.toml reproduction/pyproject.toml setup/system_packages.sh
	setup/system_packages.sh $(PYTHON)
	$(PYTHON) -m venv $(VENV)
	@# Compiling all modules takes longer than compiling those that are ever imported, when they are.
	$(BIN)/python -m pip install --quiet --no-compile --requirement $(LOCK)
	setup/meshoptimizer.sh $(BIN)/python
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable . --editable ./baselines --editable ./reproduction
	touch $@

$(QUALITY): $(INSTALLED)
	$(BIN)/python -m pip install --quiet --no-build-isolation --editable '.[quality]'
	touch $@

$(DOCS): $(INSTALLED) requirements-docs.lock
	$(BIN)/python -m pip install --quiet --no-deps --requirement requirements-docs.lock
	touch $@

$(SLURM_INSTALLED): $(INSTALLED) requirements-slurm.lock
	$(BIN)/python -m pip install --quiet --no-deps --requirement requirements-slurm.lock
	touch $@
