#!/usr/bin/env bash
# A SLURM cluster of one node on this machine, for tests: every file of it lies below DIR, it listens on
# the loopback address alone, and it runs as whoever starts it.
# Usage: slurm_cluster.sh {install|try|start|kill-node|start-node|stop} [DIR]
#   install     Debian's packages, where they are missing
#   try         whether a cluster starts here and runs a job
#   start       daemons of authentication, controller and node; then export SLURM_CONF=DIR/slurm.conf
#   kill-node   what a crashed node is: its daemon and all that its jobs run, gone at once
#   start-node  the node comes back
#   stop        the cluster ends, and all its jobs
set -euo pipefail
export PATH="$PATH:/usr/sbin:/sbin"
action=${1:?usage: slurm_cluster.sh ACTION [DIR]}
packages=(slurmctld slurmd slurm-client munge)

if [ "$action" = install ]; then
    command -v slurmctld slurmd sbatch munged >/dev/null && exit 0
    command="apt-get -o DPkg::Lock::Timeout=600 install --yes --no-install-recommends ${packages[*]}"
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "error: SLURM is not installed; as root: apt-get update && $command" >&2
        exit 1
    fi
    DEBIAN_FRONTEND=noninteractive apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $command -qq >/dev/null
    exit 0
fi

mkdir -p "${2:?usage: slurm_cluster.sh $action DIR}"
dir=$(cd "$2" && pwd)
export SLURM_CONF="$dir/slurm.conf"
cluster=synfeal-test-$(cksum <<<"$dir" | cut -d' ' -f1)
# Where SLURM's commands look: Snakemake's plugin clears SLURM_CONF, like all of SLURM's variables.
system_conf=/etc/slurm/slurm.conf

write_configuration() {
    local user host hardware
    user=$(id -un) host=$(hostname -s) hardware=$(slurmd -C | head -1)
    mkdir -p "$dir/state" "$dir/spool"
    rm -f "$dir"/{jobs.txt,slurmctld.log,slurmd.log}
    cat >"$SLURM_CONF" <<CONF
ClusterName=$cluster
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$dir/munge.socket
CredType=cred/munge
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
# No control groups, no accounting database: neither is needed to run jobs, nor there on every machine.
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$dir/jobs.txt
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
# A node that is silent for as long is down and its jobs go back to the queue; back, it is used again.
SlurmdTimeout=30
MessageTimeout=30
JobRequeue=1
ReturnToService=2
# Finished jobs are listed for as long: what Snakemake asks for when there is no accounting.
MinJobAge=600
GresTypes=gpu
NodeName=$host NodeAddr=127.0.0.1 $(grep -oE '(CPUs|RealMemory)=[0-9]+' <<<"$hardware" | xargs) Gres=gpu:2
PartitionName=cpu Nodes=$host Default=YES MaxTime=INFINITE
PartitionName=gpu Nodes=$host MaxTime=INFINITE
CONF
    # GPUs by name only: requests for one are granted, and nothing is there to compute on.
    printf 'Name=gpu File=%s\n' /dev/null /dev/zero >"$dir/gres.conf"
}

# A link that an earlier cluster of this script did not come to remove.
is_left_over() {
    [ -L "$system_conf" ] && grep -q "^ClusterName=synfeal-test-" "$system_conf" && ! pgrep -x slurmctld >/dev/null
}

start_node() {
    slurmd
    for _ in $(seq 60); do
        sinfo --noheader --format=%T | grep -qE '^(idle|mixed|allocated)$' && return
        sleep 1
    done
    echo "error: the node did not come up; see $dir/slurmd.log" >&2
    exit 1
}

# End a daemon and wait for that; its number may belong to another process by now.
stop_daemon() {
    local pid
    pid=$(cat "$dir/$1.pid" 2>/dev/null) && grep -qsx "$1" "/proc/$pid/comm" || return 0
    kill "-${2:-TERM}" "$pid" 2>/dev/null || return 0
    for _ in $(seq 100); do
        grep -qsx "$1" "/proc/$pid/comm" || return 0
        sleep 0.2
    done
}

# The node's daemon, those of its steps, and all that its jobs run, which their environment tells.
# They are stopped first: a process that sees its child die tidies up, which nothing does in a crash.
kill_node() {
    local signal process
    stop_daemon slurmd KILL
    for signal in STOP KILL; do
        for process in /proc/[0-9]*; do
            if grep -qzsx "SLURM_CLUSTER_NAME=$cluster" "$process/environ" ||
                { grep -qsx slurmstepd "$process/comm" && grep -qzsxF "SLURM_CONF=$SLURM_CONF" "$process/environ"; }; then
                kill "-$signal" "${process#/proc/}" 2>/dev/null || true
            fi
        done
    done
}

case "$action" in
    start)
        if [ -e "$system_conf" ] && ! is_left_over; then
            echo "error: $system_conf is there: this machine belongs to a cluster; run Snakemake on that" >&2
            exit 1
        fi
        write_configuration
        ln -sf "$SLURM_CONF" "$system_conf"
        [ -f "$dir/munge.key" ] || (umask 077 && head -c 1024 /dev/urandom >"$dir/munge.key")
        chmod 755 "$dir"
        munged --force --socket="$dir/munge.socket" --key-file="$dir/munge.key" \
            --pid-file="$dir/munged.pid" --seed-file="$dir/munge.seed" --log-file="$dir/munged.log"
        slurmctld -c
        start_node
        ;;
    try)
        trap '"$0" stop "$dir"' EXIT
        "$0" start "$dir"
        timeout 60 srun true
        ;;
    kill-node) kill_node ;;
    start-node) start_node ;;
    stop)
        kill_node
        stop_daemon slurmctld
        stop_daemon munged
        [ "$(readlink "$system_conf")" != "$SLURM_CONF" ] || rm "$system_conf"
        ;;
    *)
        echo "error: unknown action '$action'" >&2
        exit 1
        ;;
esac
