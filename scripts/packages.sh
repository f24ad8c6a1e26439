# Installs the Debian/Ubuntu packages that are missing. Sourced by the other scripts; does nothing when all are there.

# Packages for the program (scripts/quickstart.sh), further ones for the gate (scripts/test.sh), and further ones for
# scripts/nightly.sh and scripts/coverage.sh.
ordo_build_packages=(g++ cmake ninja-build ccache libfmt-dev zlib1g-dev libtomlplusplus-dev libmuparser-dev libcli11-dev nlohmann-json3-dev libeigen3-dev libhdf5-dev libgmsh-dev pybind11-dev python3-dev python3-numpy)
ordo_gate_packages=(git libopenmpi-dev openmpi-bin libgtest-dev clang-format clang-tidy codespell cppcheck python3 python3-matplotlib python3-vtk9)
ordo_nightly_packages=(libbenchmark-dev clang libclang-rt-dev libomp-dev llvm gcovr)

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
