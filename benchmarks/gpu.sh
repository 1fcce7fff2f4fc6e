#!/usr/bin/env bash
# Everything that a GPU is to show, in less than eight minutes, without a network and without data:
#   benchmarks/gpu.sh OUT
# writes to OUT
#   rates.csv        images learned from in a second (benchmarks/gpu.py)
#   errors_cuda.csv  errors of three seeds at 64 pixels, on the GPU
#   errors_cpu.csv   the same on a processor (benchmarks/gpu_errors.py)
#   errors_224.csv   three localizers at 224 pixels, with as many images as the time holds
# Frames are those of `night` (Large Room, 6k), drawn here. Structure's errors on the same data set
# are in results/published/night/tables/references.csv. Stages that have no time left are cut, and
# what they had measured is kept.
# PYTHON names another interpreter, MOST_S other seconds in all. PLANNED=OUT/labels, written by
# `python -m benchmarks.gpu_frames plan OUT` elsewhere, serves machines without Open3D.
# SCALE=toy DEVICE=cpu PROFILE=FILE tries it without a GPU.
set -uo pipefail
out=${1:?name a directory to write to}
python=${PYTHON:-python}
device=${DEVICE:-cuda}
most_s=${MOST_S:-460}
rates=(--most-seconds 150)
data=(--profile "${PROFILE:-night}")
small=()
planned=(${PLANNED:+--labels "$(realpath "$PLANNED")"})
large=(--models posenet posenet2 poselstm --width 1 --batch 45)
if [ "${SCALE:-}" = toy ]; then
  rates=(--toy --seconds 0.2)
  small=(--images 32 --batch 16 --seeds 0 --width 0.125)
  large=(--models posenet --width 0.0625 --batch 4)
fi
mkdir -p "$out"
out=$(realpath "$out")
cd "$(dirname "$0")/.."
export PYTHONPATH=$PWD${PYTHONPATH:+:$PYTHONPATH} OMP_NUM_THREADS=1
status=0

left() { # seconds until the end, less those that are kept for what comes later
  local seconds=$((most_s - SECONDS - ${1:-0}))
  echo $((seconds > 1 ? seconds : 1))
}
learn() { # NAME FRAMES OPTIONS...: errors_NAME.csv
  local name=$1 frames=$2
  shift 2
  timeout "$(left)" "$python" -m benchmarks.gpu_errors "$out/data/$frames" \
    --labels "$out/data/labels" --out "$out/errors_$name.csv" "$@" >"$out/errors_$name.log" 2>&1
}

# The processor plans while the GPU is measured; the GPU draws when that is over.
timeout "$(left 100)" "$python" -m benchmarks.gpu_frames plan "$out/data" "${data[@]}" \
  "${planned[@]}" \
  >"$out/plan.log" 2>&1 &
planning=$!
timeout "$(left 200)" "$python" -m benchmarks.gpu --device "$device" --out "$out/rates.csv" \
  "${rates[@]}" 2>&1 | tee "$out/rates.log" || status=1
wait "$planning" || status=1
timeout "$(left 60)" "$python" -m benchmarks.gpu_frames draw "$out/data" "${data[@]}" \
  >"$out/draw.log" 2>&1 || status=1

# The processor's runs take one core beside the GPU's.
learn cpu frames-small --device cpu "${small[@]}" &
beside=$!
[ "$device" = cpu ] || learn cuda frames-small --device cuda "${small[@]}" || status=1
# A third of the time that is left, less what starting, measuring and predicting take.
each_s=$(($(left) / 3 - 15))
[ "${SCALE:-}" != toy ] || each_s=1
learn 224 frames-large --device "$device" --seeds 0 --seconds "$each_s" "${large[@]}" || status=1
wait "$beside" || status=1
rm -r "$out/data"
tail -n 3 "$out"/*.log
echo "done in $SECONDS s"
exit "$status"
