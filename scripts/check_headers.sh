#!/bin/sh
# Compiles headers of src/ alone, one by one, with the compiler and flags of a configured build.
# Usage: scripts/check_headers.sh BUILD_DIR [HEADER...], such as build/checked src/base/vec.hpp; all headers without a list.
# One compiler message per fault; exit code 1 if there is any.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
build=${1:?usage: scripts/check_headers.sh BUILD_DIR [HEADER...]}
shift
commands=$build/compile_commands.json
if [ ! -f "$commands" ]; then
    echo "$commands: not there; configure first, such as cmake --preset checked" >&2
    exit 2
fi

# The command of app/main.cpp (which sees every dependency) without launcher, output and source.
flags=$(/usr/bin/python3 - "$commands" <<'PYTHON'
import json, os, shlex, sys

entries = json.load(open(sys.argv[1]))
found = [e for e in entries if e["file"].endswith("src/app/main.cpp")]
if not found:
    sys.exit(sys.argv[1] + ": has no src/app/main.cpp")
words = shlex.split(found[0]["command"]) if "command" in found[0] else found[0]["arguments"]
if os.path.basename(words[0]) == "ccache":
    words = words[1:]
kept, skip = [], False
for w in words:
    if skip or w in ("-c", found[0]["file"]):
        skip = False
    elif w == "-o":
        skip = True
    else:
        kept.append(w)
print(shlex.join(kept))
PYTHON
)

# Paths from src/, one per line.
[ $# -gt 0 ] || set -- $(cd "$root" && find src -name '*.hpp' | sort)
headers=$(printf '%s\n' "$@" | sed 's|^src/||')

cd "$root/src"
# An empty source that includes the header: a header as main file would cause a warning about its #pragma once.
echo "$headers" | xargs -P "$(nproc)" -I{} sh -c "echo '#include \"{}\"' | $flags -I. -fsyntax-only -x c++ - || { echo 'src/{}: does not compile alone' >&2; exit 1; }" ||
    exit 1
echo "$# headers compile alone"
