#!/usr/bin/env bash
# Make sure that Python and the system libraries are there: install them where this user may,
# otherwise say what is missing and how to get it. Usage: system_packages.sh PYTHON
set -euo pipefail
python=${1:?usage: system_packages.sh PYTHON}

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || {
    echo "error: '$python' is not Python 3.11 or newer; run 'make PYTHON=/path/to/python3.11 ...'" >&2
    exit 1
}

declare -A package_of=(
    [libEGL.so.1]=libegl1 [libEGL_mesa.so.0]=libegl-mesa0 [libGL.so.1]=libgl1
    [libusb-1.0.so.0]=libusb-1.0-0 [libgomp.so.1]=libgomp1
)
missing=()
libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
for library in "${!package_of[@]}"; do
    grep -qF "$library " <<<"$libraries" || missing+=("${package_of[$library]}")
done
[ -e /usr/share/doc/libgl1-mesa-dri ] || ls /usr/lib/*/dri/*_dri.so >/dev/null 2>&1 || missing+=(libgl1-mesa-dri)
"$python" -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3-venv)
# To build meshoptimizer (setup/meshoptimizer.sh); nobody is stopped for lack of it.
header=$("$python" -c 'import sysconfig; print(sysconfig.get_path("include") + "/Python.h")')
if { [ "$(id -u)" = 0 ] || sudo -n true 2>/dev/null; } && command -v apt-get >/dev/null; then
    command -v c++ >/dev/null || missing+=(g++)
    [ -e "$header" ] || missing+=(python3-dev)
fi
[ ${#missing[@]} -gt 0 ] || exit 0

command="apt-get -o DPkg::Lock::Timeout=600 install --yes --no-install-recommends ${missing[*]}"
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    as_root=()
elif command -v apt-get >/dev/null && sudo -n true 2>/dev/null; then
    as_root=(sudo)
else
    echo "error: missing system packages: ${missing[*]}; as root: apt-get update && $command" >&2
    exit 1
fi
echo "installing system packages: ${missing[*]}"
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" $command -qq >/dev/null
