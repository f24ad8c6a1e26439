#!/usr/bin/env bash
# Measures what a build costs: CPU time (user and system, all compilers and the linker together, not the wall clock) of the
# release build as scripts/quickstart.sh does it, without ccache, and of building the program again after a change. Works in a copy
# of the tree in a temporary folder. Prints a table for docs/performance.md.
#   scripts/rebuild_times.sh
set -euo pipefail
cd "$(dirname "$0")/.."

# What is changed, and one file that stands for it.
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
