#!/usr/bin/env bash
# Installs the package that scripts/package.sh made in a bare Debian 12, uses it as a user would, and removes it. Needs root: the Debian is made
# by debootstrap in a temporary folder and entered by chroot. Takes 2 to 5 minutes and 1.5 GB of disk; packages come from where apt has them from.
#   scripts/package_check.sh [FILE.deb]
set -euo pipefail
deb=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.."
source scripts/packages.sh

fail() { echo "package_check.sh: $*" >&2; exit 1; }
[ "$(id -u)" -eq 0 ] || exec sudo scripts/package_check.sh ${deb:+"$deb"}
install_packages "${ordo_package_check_packages[@]}"
deb=${deb:-$(ls build/package/ordo_*.deb 2>/dev/null)} || fail "there is no build/package/ordo_*.deb; run scripts/package.sh"
# shellcheck disable=SC2016  # apt's own format
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' 'Component: main' | head -n 1)
[ -n "$mirror" ] || fail "apt of this machine knows no Debian 12 (bookworm main); run it on one that does"

root=$(mktemp -d)
leave() {
  umount "$root/proc" 2>/dev/null || true
  rm -rf --one-file-system "$root"
}
trap leave EXIT
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
install_inside() { inside apt-get install -y -qq --no-install-recommends "$@" >"$root/tmp/apt.log" 2>&1 || { cat "$root/tmp/apt.log"; fail "not installed: $*"; }; }
ask() { # WHAT TEXT COMMAND..: the command must print the text
  local said
  said=$(inside "${@:3}" 2>&1) || true
  [[ $said == *"$2"* ]] || fail "$1: no \"$2\" in: $said"
  echo "$1: good"
}

lintian --allow-root --fail-on error,warning "$deb" || fail "see what lintian says"
debootstrap --variant=minbase bookworm "$root" "$mirror" >build/package/debootstrap.log || fail "debootstrap: see build/package/debootstrap.log"
mount -t proc proc "$root/proc"
cp "$deb" "$root/tmp/"
cp -r tests/package "$root/tmp/user"
cp "$(command -v qemu-x86_64-static)" "$root/tmp/qemu"
version=$(dpkg-deb -f "$deb" Version)
two_disks=/usr/share/ordo/cases/two-disks/case.toml

# The program alone, without Python.
install_inside "/tmp/$(basename "$deb")"
echo "installed with $(dpkg-query --root="$root" -W | wc -l) packages in all: $(du -shx "$root" | cut -f1)"
ask "ordo --version" "ordo $version" ordo --version
isas=$(cd "$root/usr/libexec" && printf '%s\n' ordo-* | sed 's/ordo-//')
for isa in $isas; do
  has=avx2
  [ "$isa" != x86-64-v4 ] || has=avx512
  if ! grep -qw "${has/512/512f}" /proc/cpuinfo; then
    ask "ORDO_ISA=$isa without its instructions" "this processor has no" env ORDO_ISA="$isa" ordo --version
    continue
  fi
  ask "ORDO_ISA=$isa" "instructions  $has" env ORDO_ISA="$isa" ordo --version
  inside env -C /tmp ORDO_ISA="$isa" ordo run $two_disks --set time.end=0.1 --output "short-$isa" --quiet
  [ -s "$root/tmp/short-$isa/particles.pvd" ] || fail "ORDO_ISA=$isa: no results of two-disks"
done
SECONDS=0
inside env -C /tmp ordo run $two_disks
[[ $(tail -n 1 "$root/tmp/results/two-disks/history.csv") == 3.5,* ]] || fail "two-disks: its history does not end at 3.5 s"
echo "two-disks in whole: good, $SECONDS s"
ask "another ORDO_ISA" "ORDO_ISA=x86-64-v9: there is no such build" env ORDO_ISA=x86-64-v9 ordo --version
ask "a processor without AVX2" "ordo: error: this processor has no AVX2" /tmp/qemu -cpu Nehalem /usr/bin/ordo --version
ask "without ORDO_ISA" "instructions  avx2" ordo --version
ask "a processor without AVX-512" "x86-64-v4: this processor has no AVX-512" env ORDO_ISA=x86-64-v4 /tmp/qemu -cpu max /usr/bin/ordo --version
ask "man page" "ordo $version" zcat /usr/share/man/man1/ordo.1.gz
# shellcheck disable=SC2016  # for the shell inside
ask "completion" "cpdi1 cpdi2" bash -c 'source /usr/share/bash-completion/completions/ordo
  COMP_WORDS=(ordo verify ring --method cpdi) COMP_CWORD=4; _ordo ordo; echo ${COMPREPLY[*]}'

# Python, as recommended.
install_inside python3 python3-numpy
for isa in $isas ""; do
  [ "$isa" != x86-64-v4 ] || grep -qw avx512f /proc/cpuinfo || continue
  ask "import ordo, ORDO_ISA=$isa" "step 5 of 2 bodies" env ORDO_ISA="$isa" python3 -c "
import ordo
sim = ordo.Simulation(ordo.Case('$two_disks'))
for _ in range(5): sim.step()
print('step', sim.n, 'of', len(set(sim.particles.body)), 'bodies')"
done
ask "cases of Python" "two-disks" python3 -c "import ordo; print([case['name'] for case in ordo.cases('/usr/share/ordo/cases')])"
inside ordo verify vibration-1d --method cpdi1 --cells 4,8 --data /tmp/bar >/dev/null
ask "python3 -m ordo.report" "wrote" python3 -m ordo.report /tmp/bar
ask "import ordo without AVX2" "ImportError: ordo: this processor has no AVX2" /tmp/qemu -cpu Nehalem /usr/bin/python3 -c "import ordo"

# A program on the library, with the packages that docs/packages.md names.
install_inside g++ cmake make libfmt-dev zlib1g-dev libtomlplusplus-dev libmuparser-dev libhdf5-dev
inside cmake -S /tmp/user -B /tmp/user/build -DCMAKE_BUILD_TYPE=Release >/dev/null
inside cmake --build /tmp/user/build >/dev/null
ask "find_package(ordo)" "fell 0.050" /tmp/user/build/falling_block /tmp/user/case.toml

inside dpkg -P ordo >/dev/null
left=$(find "$root" -xdev -path "$root/tmp" -prune -o \( -path '*/ordo*' -o -name 'libordo*' \) -print)
[ -z "$left" ] || fail "left after its removal: $left"
echo "removed: nothing is left"
