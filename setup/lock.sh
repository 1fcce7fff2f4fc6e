#!/usr/bin/env bash
# Print exact pins of everything installed in the environment of PYTHON. Usage: lock.sh PYTHON
set -euo pipefail
echo "# Exact versions of everything installed; written by 'make lock', read by 'make reproduce'."
# A local build's suffix (torch's "+cpu") is not part of a version that an index offers, and what only
# torch's CUDA build, `make test-slurm` and `make docs` need stands in requirements-cuda.lock,
# -slurm.lock and -docs.lock; meshoptimizer, which has to be built, in setup/meshoptimizer.sh.
docs=$(sed -nE 's/[-_.]/[-_.]/g; s/^([^#=]+)==.*/^\1==/p' "$(dirname "$0")/../requirements-docs.lock")
"$1" -m pip freeze --exclude-editable --exclude synfeal | sed -E 's/\+[a-z0-9.]+$//' |
    grep -Ev ' @ |^(nvidia|cuda)-|^triton=|^meshoptimizer=|^snakemake-(executor|storage)-plugin|^(reretry|sysrsync|toml)=' |
    grep -viE "$(paste -sd '|' <<<"$docs")"
