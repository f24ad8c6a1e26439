#!/usr/bin/env bash
# Measures the cost of builds: CPU time (user and system, of all compilers and the linker, not wall-clock time) of the release
# build of scripts/quickstart.sh without ccache, and of rebuilding the program after a change. Works in a copy of the tree in a
# temporary folder. Prints a table for docs/performance.md.
#   scripts/rebuild_times.sh
set -euo pipefail
cd "$(dirname "$0")/.."

# Kinds of changes, and a file as an example of each.
changes=(
  "a material law|src/material/neo_hookean.hpp"
  "a choice or preset in the tables of methods|src/method/tables.cpp"
  "the hats|src/shape/hat.hpp"
  "a verification case|src/verification/bars.cpp"
  "a page of text|README.md"
)

for change in "${changes[@]}"; do
  if [ ! -f "${change#*|}" ]; then
    echo "rebuild_times.sh: ${change#*|} is not there; edit the list at the top of the script" >&2
    exit 2
  fi
done

copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
git ls-files -z | while IFS= read -r -d '' file; do [ ! -f "$file" ] || printf '%s\0' "$file"; done |
  tar --null --files-from=- -cf - | tar -xf - -C "$copy"
cd "$copy"
export CCACHE_DISABLE=1
cmake --preset release -DORDO_TESTS=OFF -DORDO_BENCH=OFF >configure.log

build() { # what was done before
  local objects
  TIMEFORMAT='%U %S'
  { time cmake --build --preset release --target ordo >build.log 2>&1; } 2>cpu.log || { cat build.log >&2; return 1; }
  objects=$(grep -c 'Building CXX' build.log || true)
  awk -v what="$1" -v objects="$objects" '{printf "| %s | %d | %.0f |\n", what, objects, $1 + $2}' cpu.log
}

# shellcheck disable=SC2016
printf '| build of `ordo` after | sources compiled | CPU time, s |\n|---|---|---|\n'
build "nothing was there"
for change in "${changes[@]}"; do
  touch "${change#*|}"
  build "a change of ${change%|*} (\`${change#*|}\`)"
done
