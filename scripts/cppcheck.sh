#!/bin/sh
# cppcheck over all of src; its false alarms are in .cppcheck. Any warning fails.
set -eu
cd "$(dirname "$0")/.."
cppcheck -q -j "$(nproc)" --std=c++20 --enable=warning,performance,portability --error-exitcode=1 --suppress=missingIncludeSystem \
    --suppressions-list=.cppcheck -D__linux__ -DORDO_OPENMP -DORDO_GMSH -I src src/*/*.cpp
