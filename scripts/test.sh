#!/usr/bin/env bash
# Sets up a fresh Debian/Ubuntu machine, builds and runs every test that fits CI. The last lines are ctest's.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh

command -v apt-get >/dev/null && install_packages "${ordo_build_packages[@]}" "${ordo_test_packages[@]}"

step() { printf '\n== %s\n' "$*"; }

step static checks
python3 scripts/check_layers.py
git ls-files 'src/*.[ch]pp' 'tests/*.[ch]pp' 'bench/*.[ch]pp' | xargs clang-format --dry-run --Werror
git ls-files | xargs codespell
cppcheck -q -j 2 --std=c++20 --enable=warning,performance,portability --error-exitcode=1 --suppress=missingIncludeSystem \
  --suppressions-list=.cppcheck -D__linux__ -DORDO_OPENMP -DORDO_GMSH -I src src/*/*.cpp

step fuzz
scripts/fuzz.sh

# minimal is built by clang++, the others by g++. What `dev` adds is in them: contracts in asan-ubsan, warnings as errors in release.
for preset in minimal asan-ubsan release; do
  step "$preset"
  options=()
  [ "$preset" != release ] || options=(-DORDO_WERROR=ON)
  cmake --preset "$preset" "${options[@]}" >/dev/null
  cmake --build --preset "$preset"
  [ "$preset" = asan-ubsan ] || scripts/check_headers.sh "build/$preset"
  [ "$preset" != release ] || scripts/tidy.sh build/release
  ctest --preset "$preset" --progress
done
