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

build_preset() { # PRESET, options of cmake
  step "$@"
  cmake --preset "$@" >/dev/null
  cmake --build --preset "$1"
}

# Without OpenMP, Gmsh and HDF5; clang++. Another project would have to link the library of coverage too.
build_preset minimal -DCMAKE_CXX_FLAGS=--coverage
scripts/check_headers.sh build/minimal
find build/minimal -name '*.gcda' -delete
ctest --preset minimal --progress --exclude-regex '^package'
scripts/coverage.sh --of build/minimal

# What the preset `dev` adds is in the others: contracts in asan-ubsan, warnings as errors in release.
build_preset asan-ubsan
ctest --preset asan-ubsan --progress

build_preset release -DORDO_WERROR=ON
scripts/check_headers.sh build/release
scripts/tidy.sh build/release
ctest --preset release --progress
