#!/usr/bin/env bash
# Everything that a GPU is to show, in less than eight minutes, without a network:
#   benchmarks/gpu.sh OUT [DATA]
# writes OUT/rates.csv (benchmarks/gpu.py) and, where DATA holds packed frames and labels of a
# scene (frames/{train,test}.{npy,json}, labels/{train,test}.csv), OUT/errors_{cuda,cpu}.csv of
# three seeds each (benchmarks/gpu_errors.py). 4,500 frames of 64 pixels are 55 MB.
# PYTHON, DEVICE and SCALE=toy try it elsewhere.
set -uo pipefail
out=${1:?name a directory to write to}
data=${2:-}
python=${PYTHON:-python}
device=${DEVICE:-cuda}
rates=() errors=()
if [ "${SCALE:-}" = toy ]; then
  rates=(--toy --seconds 0.2)
  errors=(--images 64 --batch 16 --seeds 1 --width 0.125)
fi
cd "$(dirname "$0")/.."
export PYTHONPATH=$PWD${PYTHONPATH:+:$PYTHONPATH} OMP_NUM_THREADS=1
mkdir -p "$out"
status=0
learn() {
  timeout 235 "$python" -m benchmarks.gpu_errors "$data/frames" --labels "$data/labels" \
    --devices "$1" --out "$out/errors_$1.csv" "${errors[@]}" >"$out/errors_$1.log" 2>&1
}

timeout 240 "$python" -m benchmarks.gpu --device "$device" --out "$out/rates.csv" "${rates[@]}" \
  2>&1 | tee "$out/rates.log" || status=1
if [ -n "$data" ]; then # beside each other: the processor's runs take one core
  learn cpu &
  beside=$!
  [ "$device" = cpu ] || learn "$device" || status=1
  wait "$beside" || status=1
  tail -n 5 "$out"/errors_*.log
fi
exit "$status"
