# Installs the Debian/Ubuntu packages that are missing. Sourced by the other scripts, in the folder of the repository; does nothing when all are there.

# ccache knows files by their place in the repository, so that a clone finds what another one has compiled.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=1

# Packages for the program (scripts/quickstart.sh), further ones for the gate (scripts/test.sh), further ones for
# scripts/nightly.sh and scripts/coverage.sh, and those for scripts/package.sh and scripts/package_check.sh.
ordo_build_packages=(g++ cmake ninja-build ccache libfmt-dev zlib1g-dev libtomlplusplus-dev libmuparser-dev libcli11-dev nlohmann-json3-dev libeigen3-dev libhdf5-dev libgmsh-dev pybind11-dev python3-dev python3-numpy)
ordo_gate_packages=(git libopenmpi-dev openmpi-bin libgtest-dev clang-format clang-tidy codespell cppcheck python3 python3-matplotlib python3-vtk9 man-db chromium chromium-driver python3-selenium)
ordo_nightly_packages=(libbenchmark-dev clang libclang-rt-dev libomp-dev llvm gcovr)
# Those of the documentation site (scripts/site.sh) and of the notebooks, for their tests.
ordo_site_packages=(mkdocs mkdocs-material libjs-katex fonts-katex python3-nbconvert doxygen gmsh)
ordo_notebook_packages=(python3-nbconvert python3-ipykernel python3-matplotlib)
ordo_package_packages=(dpkg-dev file)
ordo_package_check_packages=(debootstrap lintian qemu-user-static)

# install_packages NAME...
install_packages() {
  local missing=()
  for name in "$@"; do
    dpkg-query -W -f='${Status}' "$name" 2>/dev/null | grep -q 'install ok installed' || missing+=("$name")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  echo "installing ${missing[*]}"
  local sudo=()
  [ "$(id -u)" -eq 0 ] || sudo=(sudo)
  "${sudo[@]}" apt-get update -qq
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}
