# Installs the Debian/Ubuntu packages that are missing. Sourced by the other scripts; does nothing when all are there.

ordo_build_packages=(g++ cmake ninja-build ccache libfmt-dev libtomlplusplus-dev libmuparser-dev libcli11-dev nlohmann-json3-dev libeigen3-dev libhdf5-dev)
ordo_test_packages=(git libgtest-dev libbenchmark-dev libgmsh-dev clang clang-format clang-tidy libclang-rt-dev libomp-dev llvm gcovr cppcheck codespell python3 python3-numpy python3-matplotlib python3-vtk9)

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
