#!/usr/bin/env bash
# Two hosts on one machine: network namespaces joined by a veth pair, half of the services on each, the hash of a local run.
# Usage: two_hosts.sh KILOTWIN SOURCES. Exit status 77 where namespaces may not be made here.
set -euo pipefail
kilotwin=$1 sources=$2
scratch=$(mktemp -d)
a=kilotwin-a-$$ b=kilotwin-b-$$
pids=()

cleanup() {
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
  ip netns delete "$a" 2>/dev/null || true
  ip netns delete "$b" 2>/dev/null || true
  rm -rf "$scratch"
}
trap cleanup EXIT

if ! { ip netns add "$a" && ip netns add "$b" && ip netns exec "$a" true; } 2>"$scratch/why"; then
  echo "network namespaces cannot be made here: $(cat "$scratch/why")"
  exit 77
fi
ip link add va type veth peer name vb netns "$b" 2>/dev/null || ip -n "$a" link add va type veth peer name vb netns "$b"
ip link set va netns "$a" 2>/dev/null || true
ip -n "$a" addr add 10.77.0.1/24 dev va
ip -n "$b" addr add 10.77.0.2/24 dev vb
for place in "$a va" "$b vb"; do
  set -- $place
  ip -n "$1" link set "$2" up
  ip -n "$1" link set lo up
done

experiment=("$sources/experiments/disperse.txtpb" --duration 10)
"$kilotwin" run "${experiment[@]}" --mode local --quiet --out "$scratch/local"
"$kilotwin" run "${experiment[@]}" --partitions 2x1 --hosts 2 --prepare --out "$scratch/run" >/dev/null

service() {  # NAMESPACE SERVICE [OPTION...]
  local place=$1
  shift
  ip netns exec "$place" "$kilotwin" service "$@" --run "$scratch/run" --domain 3 --peer 10.77.0.1 --peer 10.77.0.2 &
  pids+=($!)
}
service "$a" physics --partition 0,0
service "$b" physics --partition 1,0
service "$a" comm
service "$b" station
service "$a" behaviours --share 1/2
service "$b" behaviours --share 2/2
for pid in "${pids[@]}"; do wait "$pid"; done
pids=()

hash_of() { sed -n 's/.*"state_hash": "\([0-9a-f]*\)".*/\1/p' "$1/summary.json"; }
local_hash=$(hash_of "$scratch/local") hosts_hash=$(hash_of "$scratch/run")
echo "one process: $local_hash, two hosts: $hosts_hash"
[ -n "$local_hash" ] && [ "$local_hash" = "$hosts_hash" ]
