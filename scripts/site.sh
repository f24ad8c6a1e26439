#!/usr/bin/env bash
# Builds the documentation site in build/site: pages by MkDocs, the Python API from the built module, the reference of the C++ headers by
# Doxygen. Fails where a link or an anchor leads nowhere. Open build/site/index.html, or serve the folder.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/packages.sh

if [ ! -e build/release/python/ordo ]; then
  echo "scripts/site.sh: the Python module is not in build/release/python; build it with scripts/quickstart.sh" >&2
  exit 2
fi
! command -v apt-get >/dev/null || install_packages "${ordo_site_packages[@]}"

ORDO_SITE_CPP=1 PYTHONPATH=build/release/python PYTHONDONTWRITEBYTECODE=1 mkdocs build --strict --quiet
mkdir -p build/site/cpp
(cat docs/site/Doxyfile; echo "OUTPUT_DIRECTORY = build/site/cpp") | doxygen - 2>build/doxygen.log
/usr/bin/python3 docs/site/check_links.py build/site
echo "build/site/index.html; $(grep -c warning: build/doxygen.log || true) warnings of Doxygen are in build/doxygen.log"
