#!/usr/bin/env bash
# A cluster whose nodes share nothing, for Snakemake's cluster-generic executor (docs/clusters.md): every
# job runs in an empty folder of its own and gets its files from the store.
#   isolated_job.sh submit JOBSCRIPT   starts the job and prints its folder
#   isolated_job.sh status FOLDER      running, success or failed
set -euo pipefail
case "$1" in
    submit)
        folder=$(mktemp --directory)
        (
            cd "$folder"
            bash "$2" >"$folder.log" 2>&1 && state=success || state=failed
            [ $state = success ] && rm "$folder.log" || cat "$folder.log" >&2
            echo $state >"$folder.state"
            rm -r "$folder"
        ) >/dev/null &
        echo "$folder"
        ;;
    status) cat "$2.state" 2>/dev/null || echo running ;;
esac
