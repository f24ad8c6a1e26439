#!/usr/bin/env bash
# Runs clang-tidy on the given sources of a configured build, or on all of src and of the Python module; any warning fails.
#   scripts/tidy.sh BUILD [FILE...]
set -euo pipefail
cd "$(dirname "$0")/.."
build=$1
shift
files=("$@")
[ ${#files[@]} -gt 0 ] || files=(src/*/*.cpp python/src/*.cpp)

commands=$(mktemp -d)
trap 'rm -r "$commands"' EXIT
sed -E 's/ -(fno-ipa-[a-z-]*|m(move|store)-max=[0-9]*)//g' "$build/compile_commands.json" >"$commands/compile_commands.json" # options of GCC alone
printf '%s\0' "${files[@]}" |
  xargs -0 -P "$(nproc)" -n 1 clang-tidy -p "$commands" --quiet --extra-arg=-Wno-unknown-warning-option --warnings-as-errors='*' 2>/dev/null
