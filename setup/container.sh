#!/usr/bin/env bash
# System packages of a container image on Debian, as root: what `make` needs, then what
# system_packages.sh finds missing.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install --yes -qq --no-install-recommends \
    ca-certificates git make python3 python3-venv unzip >/dev/null
"$(dirname "$0")/system_packages.sh" python3
rm -rf /var/lib/apt/lists/*
