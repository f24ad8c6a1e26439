#!/usr/bin/env bash
# Measures which lines of src the tests run: builds the preset `coverage`, runs every test, prints the coverage of each folder and
# of all, and ends with exit code 1 below 90 %. With the argument --html it also writes build/coverage/html/index.html.
#   scripts/coverage.sh [--html]
#   scripts/coverage.sh --of BUILD      only prints the coverage of tests that have run in a build with --coverage
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh
command -v apt-get >/dev/null && install_packages "${ordo_build_packages[@]}" "${ordo_gate_packages[@]}" "${ordo_nightly_packages[@]}"

at_least=90
build=build/coverage
if [ "${1:-}" = --of ]; then
  build=$2
else
  cmake --preset coverage >/dev/null
  cmake --build --preset coverage
  find $build -name '*.gcda' -delete
  ctest --preset coverage --exclude-regex '^package'  # another project would have to link the library of coverage too
fi
gcov=gcov
! grep -q '^CMAKE_CXX_COMPILER:.*clang' "$build/CMakeCache.txt" || gcov="llvm-cov gcov"
report=(--json-summary "$build/coverage.json")
if [ "${1:-}" = --html ]; then
  mkdir -p $build/html
  report+=(--html-details $build/html/index.html)
fi
gcovr --root . --filter src/ --object-directory "$build" --gcov-executable "$gcov" --exclude-unreachable-branches \
  --exclude-throw-branches -j "$(nproc)" "${report[@]}" >/dev/null
python3 - "$at_least" "$build/coverage.json" <<'END'
import collections, json, sys

lines = collections.defaultdict(lambda: [0, 0])
for file in json.load(open(sys.argv[2]))["files"]:
    for name in (file["filename"].split("/")[1], "src"):
        lines[name][0] += file["line_covered"]
        lines[name][1] += file["line_total"]
for name, (covered, total) in sorted(lines.items()):
    print(f"{name:14s} {100 * covered / total:5.1f} %  {covered:5d} of {total} lines")
part = 100 * lines["src"][0] / lines["src"][1]
sys.exit(0 if part >= float(sys.argv[1]) else f"line coverage of src is {part:.1f} %, at least {sys.argv[1]} % are asked for")
END
