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
  # The end, or the durations of all stages.
  mapfile -t short < <("$program" check "$case" | awk '
    /^\[/ {table = $0; stages += table == "[[stage]]"}
    table == "[time]" && $1 == "end" {end = $3 / 100}
    table == "[[stage]]" && $1 == "duration" {print "--set"; print "stage." (stages - 1) ".duration=" $3 / 100}
    END {if (!stages) {print "--set"; print "time.end=" end}}')
  if "$program" run "$case" "${short[@]}" --output "$place/$name" --quiet &&
    [ -s "$place/$name/particles_000001.vtu" ] && [ "$(wc -l <"$place/$name/history.csv")" -gt 2 ]; then
    echo "$name: $(($(wc -l <"$place/$name/history.csv") - 2)) rows of history"
  else
    echo "$name: FAILED" >&2
    failed=1
  fi
done
exit $failed
