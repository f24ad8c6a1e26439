#!/usr/bin/env bash
# Fuzzes the readers of input: builds the targets of tests/fuzz and runs them side by side, one per core.
#   scripts/fuzz.sh                             20 seconds each, the same mutations each time: for CI
#   scripts/fuzz.sh SECONDS [TARGET...]         this many seconds each; for a night: scripts/fuzz.sh 14400
#   scripts/fuzz.sh --runs N [TARGET...]        this many inputs each
# Starts from tests/fuzz/corpus, from inputs that once crashed a target (tests/fuzz/found), and from inputs that earlier runs kept
# (build/fuzz/corpus). Exit code 1 if an input crashes a target, hangs it for 60 s or leaks memory; it is then in
# build/fuzz/found.
set -euo pipefail
cd "$(dirname "$0")/.."

limit=(-max_total_time=20 -seed=1)
if [ "${1:-}" = --runs ]; then
  limit=(-runs="$2")
  shift 2
elif [ $# -gt 0 ]; then
  limit=(-max_total_time="$1")
  shift
fi
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz
targets=("$@")
[ ${#targets[@]} -gt 0 ] ||
  mapfile -t targets < <(find build/fuzz/tests/fuzz -maxdepth 1 -type f -name 'fuzz_*' -executable | sed 's/.*fuzz_//' | sort)

fuzz() {
  local target=$1 result="no finding" folders=() folder
  shift
  local own=build/fuzz/corpus/$target found=build/fuzz/found log=build/fuzz/$target.log dictionary=build/fuzz/$target.dict
  mkdir -p "$own" "$found"
  for folder in tests/fuzz/{corpus,found}/"$target" tests/fuzz/{corpus,found}/"${target%_file}"; do
    [ ! -d "$folder" ] || folders+=("$folder")
  done
  cat tests/fuzz/"${target%_file}".dict >"$dictionary"
  # shellcheck disable=SC2016
  [ "$target" != case ] || grep -o '`[a-z][a-z0-9_-]*`' docs/input.md | sort -u | tr '`' '"' >>"$dictionary"
  build/fuzz/tests/fuzz/fuzz_"$target" "$@" -timeout=60 -report_slow_units=60 -rss_limit_mb=3000 -max_len=4096 \
    -print_final_stats=1 -dict="$dictionary" -artifact_prefix="$found/$target-" "$own" "${folders[@]}" >"$log" 2>&1 ||
    result="FAILED, see $log and $found"
  awk -v target="$target" -v result="$result" '/^stat::number_of_executed_units/ {n = $2}
    /^stat::average_exec_per_sec/ {speed = $2}
    END {printf "%-12s %9d inputs, %6d a second: %s\n", target, n, speed, result}' "$log"
  [ "$result" = "no finding" ]
}
export -f fuzz
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -c 'fuzz "$@"' _ {} "${limit[@]}"
