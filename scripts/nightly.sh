#!/usr/bin/env bash
# Everything that the gate (scripts/test.sh) leaves out. Continues after a failure and ends with exit code 1 if any step failed.
#   scripts/nightly.sh              all steps, hours
#   scripts/nightly.sh STEP...      some of them
#   scripts/nightly.sh --list       lists the steps
# Each step writes its row of the table in docs/testing.md when it ends: time, commit, machine and result. Rows of other steps are
# kept. The output of a step is in build/nightly/STEP.log.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 2
source scripts/packages.sh

# Name and description of each step; each has a function below.
steps() {
  cat <<'END'
tidy            clang-tidy of all sources
headers         each header alone, g++ and clang++
fuzz            what reads input, 20 s a target
release         `-O3`, warnings are errors: all tests, the whole sweep, tangents of implicit steps in all combinations in 3D
verify          `ordo verify --all`; static cases, the multigrid with up to 1.3 million unknowns
sanitizers      address and undefined behaviour, contracts: all tests but studies
minimal         clang++ without OpenMP, Gmsh and HDF5, for AVX2: all tests; at least 90 % of the lines of `src`
clang           clang++ with all libraries and contracts: all tests
avx2            `-O3` for AVX2, warnings are errors; unit and pass tests where the machine has it
avx512          the same for AVX-512
ranks           a thousand steps of every preset that ranks share, on 1 to 8 ranks of 1 and 2 threads; whole cases under mpiexec; thread sanitizer
contact         `scripts/contact_rows.py`: cases of contact and obstacles, finer than the tests, against Hertz, Lame and rigid bodies
everyday        `scripts/everyday.py`: every preset in the everyday cases, whose accounts must close
package         `scripts/package.sh`, and `scripts/package_check.sh` in a bare Debian 12
library         `library.min.js` of reports is what npm and esbuild make of its sources
faults          `scripts/planted_faults.py`
END
}

# shellcheck disable=SC2317  # called by their names
has_instructions() { # flags of /proc/cpuinfo
  local flag
  for flag in "$@"; do grep -qw "$flag" /proc/cpuinfo || return 1; done
}
has_avx2() { has_instructions avx2 bmi1 bmi2 f16c fma abm movbe; }
has_avx512() { has_avx2 && has_instructions avx512f avx512bw avx512cd avx512dq avx512vl; }

build_preset() { # PRESET, options of cmake
  cmake --preset "$@" >/dev/null && cmake --build --preset "$1"
}

step_tidy() {
  cmake --preset checked >/dev/null && cmake --build --preset checked --target ordo_version && scripts/tidy.sh build/checked
}
step_headers() {
  local preset
  for preset in checked minimal; do
    cmake --preset $preset >/dev/null && cmake --build --preset $preset --target ordo_version && scripts/check_headers.sh build/$preset || return 1
  done
}
step_fuzz() { scripts/fuzz.sh; }
step_release() {
  build_preset release -DORDO_WERROR=ON && ctest --preset release &&
    build/release/tests/test_sweep --gtest_also_run_disabled_tests --gtest_filter='*DISABLED_*'
}
step_verify() { build_preset release -DORDO_WERROR=ON && build/release/ordo verify --all && ORDO_NIGHTLY=1 ctest --preset release -R regress.static; }
step_sanitizers() { build_preset asan-ubsan && ctest --preset asan-ubsan; }
step_minimal() { # another project would have to link the library of coverage too
  build_preset minimal -DCMAKE_CXX_FLAGS=--coverage && find build/minimal -name '*.gcda' -delete &&
    ctest --preset minimal --exclude-regex '^package' && scripts/coverage.sh --of build/minimal
}
step_clang() { build_preset clang && ctest --preset clang; }
step_avx() { # PRESET, the test for its instructions
  build_preset "$1" -DORDO_WERROR=ON || return 1
  if "$2"; then ctest --preset "$1"; else echo "$1: compiled only, this machine cannot run it"; fi
}
step_avx2() { step_avx avx2 has_avx2; }
step_avx512() { step_avx avx512 has_avx512; }
step_ranks() { # a thousand steps are too many for the checked build
  local filter='Ranks*:Relay*:Travel*' layer
  build_preset release -DORDO_WERROR=ON &&
    build/release/tests/test_pass --gtest_also_run_disabled_tests --gtest_filter="$filter" || return 1
  build_preset checked && ORDO_NIGHTLY=1 ctest --preset checked -R regress.ranks || return 1
  cmake --preset tsan >/dev/null && cmake --build --preset tsan --target test_unit test_pass || return 1
  for layer in unit pass; do build/tsan/tests/test_$layer --gtest_filter="$filter" || return 1; done
}
step_contact() { build_preset release -DORDO_WERROR=ON && /usr/bin/python3 scripts/contact_rows.py --results build/nightly/contact-rows; }
step_everyday() {
  build_preset release -DORDO_WERROR=ON && /usr/bin/python3 scripts/everyday.py build/release/ordo --results build/nightly/everyday
}
step_package() { scripts/package.sh && scripts/package_check.sh; }
step_library() {
  local source=python/ordo/report/library made=build/nightly/library
  rm -rf $made && mkdir -p $made && cp $source/package*.json $source/library.js $made &&
    (cd $made && npm ci --no-audit --no-fund && npm run build) && cmp $made/library.min.js $source/library.min.js
}
step_faults() { scripts/planted_faults.py --dir build/planted --markdown build/nightly/faults.md; }

# record STEP RESULT MINUTES: puts the row of the step into the table.
record() {
  local commit machine=x86-64
  commit=$(git rev-parse --short=10 HEAD)
  git diff --quiet HEAD -- . ':!docs/testing.md' || commit="$commit, changed"
  ! has_avx2 || machine=AVX2
  ! has_avx512 || machine=AVX-512
  steps | python3 -c '
import re, sys

name, result, minutes, date, commit, machine = sys.argv[1:]
order = [line.split(None, 1) for line in sys.stdin]
page = open("docs/testing.md").read()
begin, end = "<!-- nightly: begin -->\n", "<!-- nightly: end -->\n"
head, rest = page.split(begin)
table, tail = rest.split(end)
rows = {step: row for row, step in re.findall(r"^(\| (\S+) .*)$", table, re.M)}
what = dict(order)[name].strip()
rows[name] = f"| {name} | {what} | {date} | `{commit}` | {machine} | {result} | {minutes} |"
lines = ["| step | what | date | commit | machine | result | minutes |", "|---|---|---|---|---|---|---|"]
lines += [rows.get(n, f"| {n} | {w.strip()} |  |  |  | not yet |  |") for n, w in order]
open("docs/testing.md", "w").write(head + begin + "\n".join(lines) + "\n" + end + tail)
' "$1" "$2" "$3" "$(date +%Y-%m-%d)" "$commit" "$machine"
}

if [ "${1:-}" = --list ]; then
  steps
  exit
fi
names=("$@")
[ ${#names[@]} -gt 0 ] || mapfile -t names < <(steps | awk '{print $1}')
for name in "${names[@]}"; do
  if ! steps | grep -q "^$name "; then
    echo "nightly.sh: no step $name; there are: $(steps | awk '{printf "%s ", $1}')" >&2
    exit 2
  fi
done

! command -v apt-get >/dev/null ||
  install_packages "${ordo_build_packages[@]}" "${ordo_gate_packages[@]}" "${ordo_nightly_packages[@]}" || exit 2
mkdir -p build/nightly
failed=0
for name in "${names[@]}"; do
  SECONDS=0
  printf '%s: ' "$name"
  if "step_$name" >"build/nightly/$name.log" 2>&1; then
    result=passed
    ! grep -q 'compiled only' "build/nightly/$name.log" || result="compiled"
  else
    result="**failed**"
    failed=1
  fi
  minutes=$(awk -v s=$SECONDS 'BEGIN {printf "%.1f", s / 60}')
  echo "$result, $minutes min, build/nightly/$name.log"
  record "$name" "$result" "$minutes"
done
exit $failed
