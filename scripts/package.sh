#!/usr/bin/env bash
# Makes the Debian package build/package/ordo_VERSION_amd64.deb: 20 to 45 minutes on two cores, 2 with a full ccache. It holds a build for AVX2
# and one for AVX-512 (docs/packages.md); scripts/package_check.sh tries it.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh

! command -v apt-get >/dev/null || install_packages "${ordo_build_packages[@]}" "${ordo_package_packages[@]}"
here=$PWD/build/package
for isa in x86-64-v4 x86-64-v3; do
  cmake -S . -B "$here/$isa" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DORDO_ARCH=$isa -DORDO_TESTS=OFF \
    -DORDO_PACKAGE=ON -DORDO_PACKAGE_BUILDS="$here/x86-64-v4" >/dev/null
  cmake --build "$here/$isa"
done
rm -f "$here"/ordo_*.deb
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || date +%s) cpack --config "$here/x86-64-v3/CPackConfig.cmake" -B "$here" >/dev/null
rm -rf "$here/_CPack_Packages"
ls -l "$here"/ordo_*.deb
