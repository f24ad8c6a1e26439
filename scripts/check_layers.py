#!/usr/bin/python3
"""Checks that src/ keeps its layers: base < {grid, particles, material, solve} < shape < kernels < method < {spline, implicit} < setup <
sim < io < verification < app; ranks stands beside them on base.

A file includes its own layer and those below it; grid, particles, material and solve do not include each other, nor do spline and implicit. Below io no
header includes fmt, CLI11, toml++, muParser, nlohmann-json or Eigen; sources of method, spline, implicit and setup may use fmt, those of solve Eigen.
Only base/parallel.hpp knows OpenMP; a header starts with a comment and has #pragma once. One line a fault on
stdout, exit 1 if there is any.
"""

import re
import sys
from pathlib import Path

BELOW = {"base": set()}
for name in ("grid", "particles", "material", "solve"):
    BELOW[name] = {"base"}
BELOW["shape"] = {"base", "grid", "particles", "material", "solve"}
BELOW["kernels"] = BELOW["shape"] | {"shape"}
BELOW["method"] = BELOW["kernels"] | {"kernels"}
BELOW["spline"] = BELOW["method"] | {"method"}
BELOW["implicit"] = BELOW["spline"]
BELOW["setup"] = BELOW["spline"] | {"spline", "implicit"}
BELOW["sim"] = BELOW["setup"] | {"setup"}
BELOW["io"] = BELOW["sim"] | {"sim"}
BELOW["verification"] = BELOW["io"] | {"io"}
BELOW["app"] = BELOW["verification"] | {"verification"}
BELOW["ranks"] = {"base"}  # a library of its own, which app loads

GENERATED = {"ordo_version.hpp": {"io", "verification", "app"}}
LIBRARIES = {"fmt": r"fmt/", "CLI11": r"CLI/", "toml++": r"toml\+\+/|toml\.hpp", "muParser": r"muParser", "nlohmann-json": r"nlohmann/",
             "Eigen": r"Eigen/", "Gmsh": r"gmshc?\.h"}
OF_RANKS = re.compile(r"mpi\.h|petsc")
OF_SOURCES = {"solve": {"Eigen"}, "method": {"fmt"}, "spline": {"fmt"}, "implicit": {"fmt"}, "setup": {"fmt"}}  # what sources of a layer below io may include, headers not
INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]')
OPENMP = re.compile(r"\bomp_\w|#\s*pragma\s+omp|<omp\.h>")


def library_fault(layer, is_header, included):
    """Why a file of this layer may not include this file of a library, or None."""
    if OF_RANKS.match(included):
        return None if layer == "ranks" else f"only layer ranks may include {included}"
    if layer in ("io", "verification", "app"):
        return None
    for library, pattern in LIBRARIES.items():
        of_sources = library in OF_SOURCES.get(layer, ())
        if re.match(pattern, included) and not (of_sources and not is_header):
            kind = "headers" if of_sources else "files"
            return f"{kind} of layer {layer} must not include {library}"
    return None


def include_fault(layer, path, root, quote, included):
    """Why this include is wrong, or None."""
    if quote == "<":
        return library_fault(layer, path.suffix == ".hpp", included)
    if included in GENERATED:
        return None if layer in GENERATED[included] else f"layer {layer} must not include {included}"
    target = included.split("/")[0]
    if target not in BELOW:
        return library_fault(layer, path.suffix == ".hpp", included) or f'"{included}" does not start with a layer ({", ".join(BELOW)})'
    if target != layer and target not in BELOW[layer]:
        return f"layer {layer} must not include {target}/..."
    if not (root / included).exists():
        return f'"{included}" is not in src/'
    return None


def faults_of(path, root):
    """(line, what is wrong) of one file."""
    layer = path.relative_to(root).parts[0]
    if layer not in BELOW:
        yield 1, f"{layer} is not a layer ({', '.join(BELOW)})"
        return
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, 1):
        match = INCLUDE.match(line)
        fault = include_fault(layer, path, root, match[1], match[2]) if match else None
        if fault:
            yield number, fault
        if OPENMP.search(line) and path != root / "base/parallel.hpp":
            yield number, "only base/parallel.hpp may use OpenMP"
    if path.suffix == ".hpp":
        if not lines or not lines[0].startswith("//"):
            yield 1, "a header must start with a comment that says what it is"
        if "#pragma once" not in lines:
            yield 1, "a header must have #pragma once"


def main():
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent / "src"
    files = sorted(p for p in root.rglob("*") if p.suffix in (".hpp", ".cpp", ".cu"))
    if not files:
        print(f"{root}: no sources here", file=sys.stderr)
        return 2
    faults = [(p, line, what) for p in files for line, what in faults_of(p, root)]
    for path, line, what in faults:
        print(f"{root.name}/{path.relative_to(root)}:{line}: {what}")
    if not faults:
        print(f"{len(files)} files keep their layers")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
