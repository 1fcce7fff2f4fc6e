#!/usr/bin/env bash
# Build meshoptimizer's Python binding, which has no wheels: it reads meshes compressed with meshopt.
# Where there is no C++ compiler all else works, and such meshes are refused with what to do.
# Usage: meshoptimizer.sh PYTHON
set -euo pipefail
python=${1:?usage: meshoptimizer.sh PYTHON}

"$python" -m pip install --quiet --no-deps meshoptimizer==0.2.30a0 || {
    echo "note: meshoptimizer could not be built; glTF compressed with meshopt will be refused." >&2
    echo "      On Debian and Ubuntu: apt-get install g++ python3-dev, then run this again." >&2
}
