#!/usr/bin/env bash
# Runs the examples of examples/farm for real: a Slurm cluster of one node on the loopback
# interface, and openjd-cli. In each a render is killed on the way, and the merged picture
# has to be that of one run. A stage of scripts/nightly.sh.
#
#   scripts/farm.sh [slurm|openjd…]     both, if none is named
#
# As root, installs what is missing: slurm-wlm and munge from the distribution's packages, openjd-cli
# in a virtual environment of Python. Everything else is in a folder that is removed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
unset DISPLAY WAYLAND_DISPLAY

readonly OPENJD_VERSION=0.8.0
# A shard takes many times the second after which it has a checkpoint, so that it can be killed with one.
readonly SHARDS=4 SAMPLES=16384
# Seconds that a farm may take.
readonly PATIENCE=300
scene="$PWD/scenes/cornell.gltf"
folder="$(mktemp -d)"
started=()

fail() { printf 'farm.sh: %s\n' "$*" >&2; exit 1; }

# Ends what was started here, in reverse order.
finish() {
    local status=$? index left
    ((status == 0)) || tail -n 30 "$folder"/*.log "$folder"/*/*.log 2>/dev/null || true
    # jobs first, so that nobody is left to run them again
    [[ -z "${SLURM_CONF:-}" ]] || timeout 10 scancel --user="$(id -un)" 2>/dev/null || true
    for ((index = ${#started[@]} - 1; index >= 0; index--)); do
        kill "${started[index]}" 2>/dev/null || true
    done
    # and what they started: its command line or its files are in this folder
    for ((index = 0; index < 50; index++)); do
        left="$(pgrep -f "$folder" || true)"
        [[ -n "$left" ]] || break
        # by number; some may have ended meanwhile
        ((index < 20)) || kill -KILL $left 2>/dev/null || true
        sleep 0.1
    done
    wait
    rm -rf "$folder"
    exit "$status"
}
trap finish EXIT
trap 'exit 1' INT TERM

# until WHAT COMMAND…: waits for a command to succeed.
until_so() {
    local what="$1" end=$((SECONDS + PATIENCE))
    shift
    until "$@" >/dev/null 2>&1; do
        ((SECONDS < end)) || fail "still not so after $PATIENCE s: $what"
        sleep 0.1
    done
}

# Kills the render whose command line has a text, with SIGKILL, once it has a checkpoint.
kill_render() {
    local text="$1" checkpoint="$2" process
    until_so "$checkpoint is there" test -s "$checkpoint"
    process="$(pgrep -f "^[^ ]*etendue render .*$text")" || fail "no render of $text is left to be killed"
    kill -KILL $process
}

# The verdict on the merged picture of a system.
same_picture() {
    local system="$1" what="$2" verdict
    verdict="$("$etendue" compare "$folder/single.exr" "$folder/$system/out.exr" | tail -n 1)"
    [[ "$verdict" == identical:* ]] || fail "$system: the merged picture is not that of one run: $verdict"
    printf 'farm.sh: %-6s %s, %s; the merged picture and one run are %s\n' "$system" "$("${system}_version")" "$what" "$verdict"
}

# Whether a package is installed, after trying to.
package() {
    [[ -z "$(installed "$1")" ]] || return 0
    [[ "$(id -u)" == 0 ]] || fail "$1 is missing; as root: apt-get install $1"
    say "apt-get install $1"
    apt-get update >&2
    DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends "$1" >&2
}

# A port that nobody listens on.
free_port() {
    local port
    for ((port = $1; port < $1 + 100; port++)); do
        (: <>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return; }
    done
    fail "no free port from $1 on"
}

node_is_idle() { [[ "$(sinfo --noheader --format=%T)" == idle ]]; }
slurm_version() { sinfo --version; }

start_slurm() {
    local host user
    host="$(hostname -s)"
    user="$(id -un)"
    mkdir -p "$folder/state" "$folder/spool" "$folder/etc"
    dd if=/dev/urandom of="$folder/etc/munge.key" bs=1024 count=1 status=none
    chmod 600 "$folder/etc/munge.key"
    cat >"$folder/etc/slurm.conf" <<CONF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$(free_port 16817)
SlurmdPort=$(free_port 16918)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket,cred_expire=5
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=10
NodeName=$host NodeAddr=127.0.0.1 CPUs=2
PartitionName=loopback Nodes=$host Default=YES
CONF
    # The daemons watch processes by /proc here; older ones do not know the word.
    if at_least "$(slurmd -V | cut -d' ' -f2)" 23.02; then
        echo CgroupPlugin=disabled >"$folder/etc/cgroup.conf"
    fi
    export SLURM_CONF="$folder/etc/slurm.conf"
    munged --foreground --force --key-file="$folder/etc/munge.key" --socket="$folder/munge.socket" \
        --pid-file="$folder/munged.pid" --log-file="$folder/munged.log" --seed-file="$folder/munged.seed" \
        >"$folder/munged.out.log" 2>&1 &
    started+=($!)
    until_so "munged listens" test -S "$folder/munge.socket"
    slurmctld -D >"$folder/slurmctld.out.log" 2>&1 &
    started+=($!)
    slurmd -D -N "$host" >"$folder/slurmd.out.log" 2>&1 &
    started+=($!)
    until_so "the node is idle" node_is_idle
}

state() { scontrol --oneliner show job "$1" | grep -o 'JobState=[A-Z_]*' | cut -d= -f2; }
restarts() { scontrol --oneliner show job "$1" | grep -o ' Restarts=[0-9]*' | cut -d= -f2; }
has_ended() { [[ "$(state "$1")" =~ ^(COMPLETED|FAILED|CANCELLED|TIMEOUT|NODE_FAIL|OUT_OF_MEMORY)$ ]] || is_refused "$1"; }
# A dependency that will never be fulfilled leaves the job waiting.
is_refused() { scontrol --oneliner show job "$1" | grep -q 'Reason=DependencyNeverSatisfied'; }

try_slurm() {
    local line array merge shards="$folder/slurm/out.shards"
    package munge
    package slurm-wlm
    start_slurm
    mkdir "$folder/slurm"
    line="$(ETENDUE="$etendue" examples/farm/slurm.sh "$scene" "$folder/slurm/out.exr" "$SHARDS" "$SAMPLES" \
        --width 64 --checkpoint-interval 1)"
    array="$(cut -d' ' -f2 <<<"$line")" merge="$(cut -d' ' -f7 <<<"$line")"
    [[ "$array" =~ ^[0-9]+$ && "$merge" =~ ^[0-9]+$ ]] || fail "what slurm.sh printed: $line"
    # One is killed; another one is told of its time limit.
    kill_render "$shards/000001.part.exr" "$shards/000001.ck"
    until_so "task 2 has a checkpoint" test -s "$shards/000002.ck"
    scancel --signal=USR1 --batch "${array}_2"
    until_so "job $merge has ended" has_ended "$merge"
    [[ "$(state "$merge")" == COMPLETED ]] || fail "slurm: the merge is $(state "$merge")"
    for task in 1 2; do
        [[ "$(restarts "${array}_$task")" == 1 ]] || fail "slurm: task $task was not run again"
        grep -q 'going on from samples' "$shards/00000$task.log" || fail "slurm: task $task began anew"
    done
    same_picture slurm "$SHARDS shards, one of them killed and one near its time limit"
}

openjd_version() { "$openjd" --version; }

try_openjd() {
    local environment="$CACHE/openjd-$OPENJD_VERSION" process status=0 out="$folder/openjd"
    openjd="$environment/bin/openjd"
    if [[ ! -x "$openjd" ]]; then
        python3 -m venv "$environment" 2>/dev/null || { package python3-venv && python3 -m venv "$environment"; }
        "$environment/bin/pip" install --quiet "openjd-cli==$OPENJD_VERSION"
    fi
    mkdir "$out"
    "$openjd" check examples/farm/openjd.yaml >"$folder/openjd.check.log" || fail "openjd: the template does not hold"
    openjd_run() {
        TMPDIR="$folder" PATH="$(dirname "$etendue"):$PATH" exec "$openjd" run examples/farm/openjd.yaml --step Merge --run-dependencies \
            -p Scene="$scene" -p Folder="$out" -p LastShard=$((SHARDS - 1)) -p SamplesPerShard="$SAMPLES" \
            -p Options="--width 64 --checkpoint-interval 1" >>"$folder/openjd.log" 2>&1
    }
    openjd_run &
    process=$!
    started+=("$process")
    kill_render "$out/out.1.exr" "$out/out.1.ck"
    wait "$process" || status=$?
    ((status != 0)) || fail "openjd: a killed task went unnoticed"
    # What runs jobs here does not repeat a task; the job is started again.
    (openjd_run) || fail "openjd: the second attempt"
    grep -q 'going on from samples' "$folder/openjd.log" || fail "openjd: the shard began anew"
    same_picture openjd "$SHARDS shards, one of them killed and the job started again"
}

cargo build --release --locked
etendue="$(realpath "$CARGO_TARGET_DIR")/release/etendue"
"$etendue" render "$scene" -o "$folder/single.exr" --width 64 --spp $((SHARDS * SAMPLES)) --quiet
systems=("$@")
(($# > 0)) || systems=(slurm openjd)
for system in "${systems[@]}"; do
    case "$system" in
        slurm | openjd) "try_$system" ;;
        *) fail "no system $system" ;;
    esac
done
