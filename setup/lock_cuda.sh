#!/usr/bin/env bash
# Print what torch's CUDA build pins beyond requirements.lock, without installing anything.
# Usage: lock_cuda.sh PYTHON
set -euo pipefail
python=${1:?usage: lock_cuda.sh PYTHON}
folder=$(dirname "$0")/..
report=$(mktemp)
trap 'rm -f "$report"' EXIT

torch=$(sed -n 's/^torch==//p' "$folder/requirements.lock")
# "===" matches no local build: neither "+cpu" nor another.
PIP_FIND_LINKS='' "$python" -m pip install --quiet --dry-run --ignore-installed --report "$report" \
    --requirement "$folder/requirements.lock" "torch===$torch" >&2
echo "# requirements.lock with torch's CUDA build (Linux, x86-64); written by 'make lock'."
echo "--requirement requirements.lock"
echo "torch===$torch"
"$python" - "$report" "$folder/requirements.lock" <<'PYTHON'
import json
import re
import sys
from pathlib import Path

def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()

report, lock = map(Path, sys.argv[1:])
known = {canonical(line.split("==")[0]) for line in lock.read_text().splitlines() if "==" in line}
found = {
    canonical(item["metadata"]["name"]): item["metadata"]["version"]
    for item in json.loads(report.read_text())["install"]
}
for name in sorted(found.keys() - known):
    print(f"{name}=={found[name]}")
PYTHON
