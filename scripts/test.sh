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

for preset in minimal asan-ubsan release dev; do
  step "$preset"
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset"
  if [ "$preset" = dev ]; then
    scripts/check_headers.sh build/dev
    scripts/tidy.sh build/dev
  fi
  ctest --preset "$preset" --progress
done
