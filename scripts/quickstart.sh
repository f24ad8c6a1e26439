#!/usr/bin/env bash
# Sets up a fresh Debian/Ubuntu machine, builds the release and runs the collision of two disks. Cheap to repeat.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh

command -v apt-get >/dev/null && install_packages "${ordo_build_packages[@]}"
cmake --preset release -DORDO_TESTS=OFF -DORDO_BENCH=OFF >/dev/null
cmake --build --preset release

echo
if [ -e results/two-disks ]; then
  echo "results/two-disks is there already and is left alone; --overwrite replaces it"
else
  build/release/ordo run cases/two-disks/case.toml
fi
cat <<TEXT

In results/two-disks:
  particles.pvd, particles_*.vtu   open particles.pvd in ParaView, press Apply, colour by velocity, press play
  history.csv                      time, mass, momentum and energies, a row a step
  case.toml                        the case with every default
Next: docs/tutorials/first-case.md; build/release/ordo list; build/release/ordo run cases/NAME/case.toml
TEXT
