#!/usr/bin/env bash
# Runs the first hundredth of every case of cases/ and checks that frames and history are there.
#   scripts/smoke.sh PROGRAM, such as build/release/ordo
set -euo pipefail
cd "$(dirname "$0")/.."
program=${1:?usage: scripts/smoke.sh PROGRAM}
place=$(mktemp -d)
trap 'rm -r "$place"' EXIT
failed=0
for case in cases/*/case.toml; do
  name=$(basename "$(dirname "$case")")
  end=$("$program" check "$case" | awk '/^\[/ {is_time = $0 == "[time]"} is_time && $1 == "end" {print $3 / 100}')
  if "$program" run "$case" --set "time.end=$end" --output "$place/$name" --quiet &&
    [ -s "$place/$name/particles_000001.vtu" ] && [ "$(wc -l <"$place/$name/history.csv")" -gt 2 ]; then
    echo "$name: $(($(wc -l <"$place/$name/history.csv") - 2)) rows of history"
  else
    echo "$name: FAILED" >&2
    failed=1
  fi
done
exit $failed
