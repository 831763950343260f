#!/usr/bin/env bash
# usage: slurm_test.sh KILOTWIN SOURCES
# A sweep of 100 runs on a real Slurm of one node, whose daemons are this script's own. squeue fails for a while, the node fails while
# elements of the array run, and the sweep's own process is killed while its job goes on. In the end there must be the rows of the
# same sweep without Slurm. Status 77: there is no Slurm, or this is not root, which slurmd needs.
set -euo pipefail
program=$1 sources=$2

for tool in slurmctld slurmd sbatch munged python3; do
  command -v "$tool" > /dev/null || { echo "no $tool here: apt-get install slurmctld slurmd slurm-client munge"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "slurmd needs root"; exit 77; }

scratch=$(mktemp -d "${TMPDIR:-/tmp}/kilotwin-slurm-XXXXXX")
stop() { # SIGNAL: of the daemons
  local file
  for file in "$scratch"/*.pid; do
    if [ -e "$file" ]; then kill "-$1" "$(cat "$file")" 2> /dev/null || true; fi
  done
}
finish() {
  stop TERM
  sleep 1
  stop KILL
  rm -rf "$scratch"
}
trap finish EXIT

# Whether Slurm itself can run on this machine is not what is tested.
no_slurm() {
  echo "Slurm does not run here: $1"
  exit 77
}
port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
chmod 755 "$scratch"
mkdir -m 700 "$scratch/munge"
mkdir "$scratch/state" "$scratch/spool"
head -c 1024 /dev/urandom > "$scratch/munge/key"
chmod 600 "$scratch/munge/key"
munged --key-file="$scratch/munge/key" --socket="$scratch/munge/socket" --pid-file="$scratch/munged.pid" \
  --log-file="$scratch/munge/log" --seed-file="$scratch/munge/seed" --num-threads=2 --force || no_slurm "munged ends"
node=$(hostname -s)
export SLURM_CONF="$scratch/slurm.conf"
cat > "$SLURM_CONF" << END
ClusterName=one
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$(port)
SlurmdPort=$(port)
SlurmUser=root
AuthInfo=socket=$scratch/munge/socket
StateSaveLocation=$scratch/state
SlurmdSpoolDir=$scratch/spool
SlurmctldPidFile=$scratch/slurmctld.pid
SlurmdPidFile=$scratch/slurmd.pid
SlurmctldLogFile=$scratch/slurmctld.log
SlurmdLogFile=$scratch/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdTimeout=10
SchedulerParameters=sched_interval=1,batch_sched_delay=1
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc)
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
slurmctld || no_slurm "slurmctld ends"
slurmd || no_slurm "slurmd ends"
waits=0
until sinfo -h -o %T 2> /dev/null | grep -q idle; do
  waits=$((waits + 1))
  [ "$waits" -lt 150 ] || { tail -n 5 "$scratch"/*.log; no_slurm "its node does not come up"; }
  sleep 0.2
done

cd "$sources"
readonly runs=100
experiment=(experiments/disperse.txtpb --robots 4 --duration 2 --seeds 1..25 --set robots.layout.grid.pitch_mm=40..46:2)
of_sweep=0
# Starts the sweep with these arguments, and with an squeue that fails twice before it answers.
start() {
  mkdir -p "$scratch/flaky"
  echo 2 > "$scratch/flaky/left"
  cat > "$scratch/flaky/squeue" << END
#!/usr/bin/env bash
left=\$(cat "$scratch/flaky/left")
echo "\$((left - 1))" > "$scratch/flaky/left"
if [ "\$left" -gt 0 ]; then echo "slurm_load_jobs error: Unable to contact slurm controller" >&2; exit 1; fi
exec "$(command -v squeue)" "\$@"
END
  chmod +x "$scratch/flaky/squeue"
  PATH="$scratch/flaky:$PATH" "$program" sweep "${experiment[@]}" --slurm "$@" > "$scratch/sweep.log" 2>&1 &
  of_sweep=$!
}
fail() {
  echo "FAILED: $1"
  cat "$scratch"/*.log
  exit 1
}
done_runs() { find "$scratch/sweep" -name summary.json 2> /dev/null | wc -l; }
# Waits for that many runs, or the end of the sweep.
await_runs() {
  until [ "$(done_runs)" -ge "$1" ]; do
    kill -0 "$of_sweep" 2> /dev/null || fail "the sweep ended after $(done_runs) runs"
    sleep 0.1
  done
}
start --out "$scratch/sweep"
await_runs 5
grep -q "squeue fails: slurm_load_jobs error" "$scratch/sweep.log" || fail "a squeue that fails is not reported"
# The process that waits is killed, as where somebody logs out. Its job goes on.
kill -KILL "$of_sweep"
{ wait "$of_sweep" || true; } 2> /dev/null
status=0
"$program" sweep "${experiment[@]}" --resume "$scratch/sweep" > "$scratch/refused.log" 2>&1 || status=$?
[ "$status" = 2 ] || fail "it resumed beside its own job"
grep -q "still in the queue" "$scratch/refused.log" || fail "it does not say why it does not resume"
scancel "$(cat "$scratch/sweep/slurm-job")"
until [ -z "$(squeue --noheader)" ]; do sleep 0.2; done

start --resume "$scratch/sweep"
await_runs $(($(done_runs) + 5))
before=$(done_runs)
# The node's power fails: its daemon ends, and all that it had started.
kill -KILL "$(cat "$scratch/slurmd.pid")"
for process in $(pgrep -f "$scratch/sweep/" || true) $(pgrep -f "slurmstepd.*" || true); do
  if [ "$process" != "$of_sweep" ] && grep -qz "SLURM_CONF=$SLURM_CONF" "/proc/$process/environ" 2> /dev/null; then
    kill -KILL "$process" 2> /dev/null || true
  fi
done
sleep 1
slurmd
echo "the node failed after $before of $runs runs"

status=0
wait "$of_sweep" || status=$?
if [ "$status" = 1 ]; then
  echo "lost elements are submitted again"
  "$program" sweep "${experiment[@]}" --slurm --resume "$scratch/sweep" > "$scratch/resumed.log" 2>&1 || fail "it cannot be resumed"
elif [ "$status" != 0 ]; then
  fail "status $status"
fi
[ ! -e "$scratch/sweep/slurm-job" ] || fail "the job's id stays after its end"
"$program" sweep "${experiment[@]}" --out "$scratch/plain" > /dev/null 2>&1
python3 - "$scratch/sweep/runs.csv" "$scratch/plain/runs.csv" "$runs" << 'END'
import csv
import sys

# Fields that depend on the machine, or on the place of the results, may differ.
DIFFERS = {"directory", "wall_s", "start_s", "cpu_s", "peak_memory_mib", "run", "speed"}
tables = [[{k: v for k, v in row.items() if k not in DIFFERS} for row in csv.DictReader(open(name))] for name in sys.argv[1:3]]
if len(tables[0]) != int(sys.argv[3]) or tables[0] != tables[1]:
    print(f"FAILED: {len(tables[0])} rows by Slurm, {len(tables[1])} without")
    for one, other in zip(*tables):
        if one != other:
            print({k: (one[k], other[k]) for k in one if one[k] != other[k]})
            break
    sys.exit(1)
print(f"{len(tables[0])} rows, as without Slurm")
END
