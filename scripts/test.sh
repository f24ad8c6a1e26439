#!/usr/bin/env bash
# The gate, which CI runs (.ci/run). Sets up a fresh Debian/Ubuntu machine; then takes 15 to 45 minutes on two cores, the
# less with a full ccache: static checks; one checked build (contracts on, warnings are errors) and all tests with it; clang-tidy and headers
# of changed files; the release build and the beginning of every case with it. The last lines are ctest's. Other compilers,
# instructions and sanitizers are in scripts/nightly.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh
source scripts/changed.sh

tidy_at_most=20  # sources, the last changed first: two minutes of CPU time; all are the nightly's

step() { printf '\n== %s\n' "$*"; SECONDS=0; }
times=()
took() { times+=("$(printf '%3d min %02d s  %s' $((SECONDS / 60)) $((SECONDS % 60)) "$*")"); echo "-- ${times[-1]}"; }

step packages
! command -v apt-get >/dev/null || install_packages "${ordo_build_packages[@]}" "${ordo_gate_packages[@]}" "${ordo_site_packages[@]}" "${ordo_notebook_packages[@]}"
took packages

step static checks
python3 scripts/check_layers.py
python3 scripts/planted_faults.py --list >/dev/null  # the texts of the faults are there
git ls-files 'src/*.[ch]pp' 'tests/*.[ch]pp' 'bench/*.[ch]pp' 'python/*.[ch]pp' 'packaging/*.[ch]pp' | xargs clang-format --dry-run --Werror
git ls-files | xargs codespell
scripts/cppcheck.sh
took static checks

step checked build
cmake --preset checked >/dev/null
cmake --build --preset checked
took checked build

mapfile -t headers < <(changed_files 'src/*.hpp')
mapfile -t sources < <(changed_files 'src/*.cpp' 'python/src/*.cpp')
step "headers and clang-tidy of ${#headers[@]} and ${#sources[@]} changed files"
[ ${#headers[@]} -eq 0 ] || scripts/check_headers.sh build/checked "${headers[@]}"
if [ ${#sources[@]} -gt $tidy_at_most ]; then
  echo "clang-tidy: the $tidy_at_most sources that changed last; scripts/nightly.sh tidy looks at all"
  sources=("${sources[@]:0:$tidy_at_most}")
fi
[ ${#sources[@]} -eq 0 ] || scripts/tidy.sh build/checked "${sources[@]}"
took headers and clang-tidy of changed files

# As scripts/quickstart.sh builds it, but with warnings as errors, because -O3 gives other warnings.
step release build
cmake --preset release -DORDO_TESTS=OFF -DORDO_BENCH=OFF -DORDO_WERROR=ON >/dev/null
cmake --build --preset release
took release build

step the begin of every case
scripts/smoke.sh build/release/ordo
took the begin of every case

step checked tests, after
printf '%s\n' "${times[@]}"
ctest --preset checked --progress
