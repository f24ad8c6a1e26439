#!/usr/bin/python3
"""Shows that two builds of ordo give the same outputs.

    scripts/compare_outputs.py OLD_ORDO NEW_ORDO
    scripts/compare_outputs.py OLD_ORDO NEW_ORDO --only cpdi1,two-disks    runs whose name has one of these words
    scripts/compare_outputs.py OLD_ORDO NEW_ORDO --list                    names of all runs

Runs every preset on small cases in 1D, 2D and 3D, every choice of the method on one case, every material law, and coarse
studies of `ordo verify`, with both programs on one thread. Compares all files byte by byte. Where bytes differ, numbers are
compared: the largest difference of a field, divided by the largest number of that field in the run (of energies and of
momenta: of all of them; of stresses and energies: by a modulus, times the volume, where that is larger). Prints one line a
run. What both refuse is the same; messages may differ.

Not compared: comments in case.toml (they name the commit), times that were measured, and keys of case.toml that only one
program writes. Errors of `ordo verify` are small differences of large numbers: they may differ by --verify-tolerance.
Exit code: 0 when all agree within the tolerance, 1 when one does not, 2 for wrong usage.
"""

import argparse
import concurrent.futures
import csv
import dataclasses
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZES = {"Int8": "i1", "UInt8": "u1", "Int32": "i4", "UInt32": "u4", "Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8"}
FIELDS = 'output.fields=["displacement","velocity","stress","deformation_gradient","density","mass","volume","pressure",' \
         '"von_mises","energy_density"]'

# Names of cases, and settings that keep them below 100 steps and a few seconds.
CASES = {
    "vibrating-bar": ["time.end=0.005", "output.interval=0.0025"],
    "two-disks": ["time.dt=0.01", "time.end=1.0", "output.interval=0.5", "body.0.velocity=[0.15,0.15]", "body.1.velocity=[-0.15,-0.15]"],
    "wall-rebound": ["time.dt=0.01", "time.end=1.0", "output.interval=0.5"],
    "cantilever": ["grid.spacing=0.1", "time.end=0.12", "output.interval=0.06"],
    "pressure-ring": ["time.end=0.06", "output.interval=0.03"],
    "bimaterial-bar": ["time.end=0.005", "output.interval=0.0025"],
    "bimaterial-ring": ["time.end=1e-5", "output.interval=5e-6"],
    "bimaterial-sphere": ["time.end=0.001", "output.interval=0.0005"],
    "two-balls": ["grid.spacing=0.1", "time.dt=0.015", "time.end=0.6", "output.interval=0.3"],
    "ball-on-wall": ["grid.spacing=0.1", "time.end=0.2", "output.interval=0.1"],
}
# Cases, and presets with which they are not run: splines would take minutes for this ball.
TOO_LONG = {"ball-on-wall": ("spline3", "spline4", "spline5")}
# Preset, settings: choices of the method that no preset has, on two-disks.
CHOICES = [
    ("cpdi1", ["scheme=usf"]), ("cpdi1", ["scheme=musl"]), ("mpm", ["scheme=usf"]), ("mpm", ["start=plain"]),
    ("mpm", ["pic_fraction=0.1"]), ("cpdi1", ["pic_fraction=0.1", "scheme=musl"]), ("cpdi1", ["stretch_limit=1.5"]),
    ("cpdi2", ["cell_weights=mean"]), ("cpdi2", ["enrichment=interface"]), ("cpdi2", ["enrichment=layers"]),
    ("cpdi2e", ["corner_velocity=kept"]), ("cpdi2e", ["scheme=usf"]), ("cpdi1", ["basis=bspline2"]),
    ("cpdi1", ["basis=bspline3"]), ("mpm", ["basis=bspline3"]), ("ugimp", ["basis=bspline3"]), ("cpdi2t", ["basis=bspline2"]),
    ("mpm", ["projection=gradient-enhanced"]), ("cpdi1", ["projection=affine", "update=apic"]),
    ("polypic", ["degree=2"]), ("icpdi1", ["weight=hat"]), ("icpdi1", ["degree=2"]), ("cpls", ["samples=particles"]),
    ("icpdi2", ["samples=corners"]), ("impm", ["cell_volume=filled"]), ("impm", ["degree=2"]), ("impm", ["quadrature=gauss"]),
    ("tls-mpm", ["tls=velocity"]), ("tls-mpm", ["tls=stress", "projection=tls"]), ("tls-bsmpm", ["degree=1"]),
    ("bsmpm", ["lump_below=0"]), ("bsmpm", ["scheme=usl"]), ("mpm", ["mass=consistent"]), ("cpdi1", ["mass=consistent"]),
    ("ddmpm", ["a0=0.25"]), ("ddmpm", ["mass=lumped"]), ("mpm", ["gradient=adjoint", "quadrature=cell"]),
]
LAWS = ["neo-hookean", "st-venant-kirchhoff", "jaumann-elastic", "linear-rate-1d"]
# Runs of `ordo verify`: case, presets, cells, settings. The first three with every preset.
STUDIES = [
    ("vibration-1d", None, "8", []),
    ("vibration-2d", None, "8", ["end=0.002"]),
    ("vibration-3d", None, "4", ["end=0.002"]),
    ("vibration-shifted", "cpdi1,bsmpm,tls-bsmpm,spline3,spline5", "16", []),
    ("vibration-free", "cpdi1,apic,spline3,spline4,spline5", "16", ["end=0.004"]),
    ("bent-box", "cpdi1,spline3,spline4,spline5", "8", ["end=0.003"]),
    ("ring", "cpdi1,cpdi2,fem,spline3", "10", ["rims=loaded", "nu=0.3", "end=0.003"]),
    ("vortex", "cpdi1,bscpdi2,impm-adjoint,cpls", "8", ["end=0.05"]),
    ("simple-shear", "cpgimp,cpdi1,cpdi2,mls-mpm", "8", ["end=0.02"]),
    ("rotation", "cpdi1,polypic", "8", ["end=0.02"]),
    ("bar-small-strain", "mpm,bsmpm,ddmpm,tls-mpm", "10", []),
    ("bar-large-strain", "mpm,bsmpm,tls-bsmpm", "20", ["end=0.002"]),
    ("bar-traction", "cpdi1,cpdi2", "16", []),
    ("plate-impact", "cpdi1,bsmpm", "100", []),
    ("couette", "mpm,cpls", "8", []),
    ("plastic-ring", "cpdi2", "10", []),
    ("viscous-box", "cpdi1", "8", []),
    ("grains-on-plane", "ugimp", "40", ["end=0.2"]),
    ("bimaterial-bar", "cpdi2,cpdi2e,fem", "1", ["end=0.005"]),
    ("reconstruction", "mpm,imls-mpm,tls-mpm", "64", []),
    ("dispersion", "mpm,cpdi1,bsmpm", "16", ["steps=100"]),
]
LIMIT = 300  # s of a run
MEASURED = re.compile(r"seconds|time_per|particles_per_second|_ns$|_cpu$")


@dataclasses.dataclass
class Run:
    name: str
    arguments: list  # what follows `ordo`, where OUT is the folder of the outputs
    is_study: bool = False


def presets_of(program):
    page = subprocess.run([program, "list", "methods"], capture_output=True, text=True, check=True).stdout
    return re.findall(r"^  (\S+) ", page.split("Axes")[0], re.MULTILINE)


def settings(values):
    return [word for value in values for word in ("--set", value)]


def run_of(case, preset, values, name):
    words = ["run", str(ROOT / "cases" / case / "case.toml"), "--threads", "1", "--quiet", "--output", "OUT"]
    return Run(name, words + settings([f"method.preset={preset}", FIELDS, *CASES[case], *values]))


def all_runs(presets):
    runs = [run_of(case, preset, [], f"{case} {preset}") for case in CASES for preset in presets
            if preset not in TOO_LONG.get(case, ())]
    for preset, values in CHOICES:
        runs.append(run_of("two-disks", preset, [f"method.{v}" for v in values], f"two-disks {preset} {' '.join(values)}"))
    for preset in ("mpm", "cpdi1", "cpdi2e", "bsmpm"):
        runs.append(run_of("two-disks", preset, ["output.grid=true"], f"two-disks {preset} with its grid"))
    for law in LAWS:
        for case, preset in (("vibrating-bar", "mpm"), ("two-disks", "cpdi1"), ("two-balls", "cpdi1"), ("two-disks", "bsmpm")):
            runs.append(run_of(case, preset, [f"material.0.model={law}"], f"{case} {preset} {law}"))
    for case, some, cells, values in STUDIES:
        for preset in some.split(",") if some else presets:
            words = ["verify", case, "--method", preset, "--cells", cells, "--threads", "1", "--json", "OUT/study.json"]
            runs.append(Run(f"verify {case} {preset}", words + settings(values), True))
    return runs


# ---- output of a run -------------------------------------------------------------------------------------------------


def start(program, run, folder):
    """Exit code, message and files of a run. Messages are without paths of folders and measured times."""
    folder.mkdir()
    words = [program, *(w.replace("OUT", str(folder)) for w in run.arguments)]
    done = subprocess.run(words, capture_output=True, text=True, errors="replace", timeout=LIMIT, check=False)
    files = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    return done.returncode, done.stderr.replace(str(folder), "OUT"), files


def vtk_fields(data):
    """Arrays of a VTU or VTI file, whose data are appended raw, each after its length of 64 bits."""
    head, tail = data.split(b'<AppendedData encoding="raw">', 1)
    tail = tail[tail.index(b"_") + 1:]
    fields = {}
    for tag in re.findall(rb"<DataArray [^>]*>", head):
        at = dict(re.findall(r'(\w+)="([^"]*)"', tag.decode()))
        if at["format"] != "appended":
            text = head[head.index(tag) + len(tag):]
            fields[at["Name"]] = numpy.array(text[:text.index(b"<")].split(), dtype=float)
            continue
        begin = int(at["offset"])
        size = int.from_bytes(tail[begin:begin + 8], "little")
        fields[at["Name"]] = numpy.frombuffer(tail, SIZES[at["type"]], size // int(SIZES[at["type"]][1]), begin + 8).astype(float)
    return fields


def pvd_fields(data):
    """The list of frames: their names and times."""
    names = {name: numpy.zeros(1) for name in re.findall(r'file="([^"]*)"', data.decode())}
    return {"time": numpy.array(re.findall(r'timestep="([^"]*)"', data.decode()), dtype=float), **names}


def csv_fields(data):
    rows = list(csv.reader(data.decode().splitlines()))
    table = numpy.array([[float(x or "nan") for x in row] for row in rows[1:]]).reshape(-1, len(rows[0]))
    return dict(zip(rows[0], table.T))


def json_fields(data):
    """Numbers by their path, without measured times."""
    fields = {}

    def walk(value, path):
        if isinstance(value, dict):
            for key, inner in value.items():
                if not MEASURED.search(key):
                    walk(inner, f"{path}.{key}")
        elif isinstance(value, list):
            for inner in value:
                walk(inner, path)
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            fields.setdefault(path.strip("."), []).append(float(value))
        else:
            fields.setdefault(f"{path.strip('.')} is {value}", []).append(0.0)

    walk(json.loads(data), "")
    return {key: numpy.array(values) for key, values in fields.items()}


PER_VOLUME = ("stress", "pressure", "von_mises", "energy_density")  # Pa or J/m^3
READERS = {".vtu": vtk_fields, ".vti": vtk_fields, ".pvd": pvd_fields, ".csv": csv_fields, ".json": json_fields}


def group(name):
    """The vector, tensor or kind to which a column belongs; its members share a scale."""
    if name.endswith("_energy"):
        return "energies"
    return re.sub(r"(_(x|y|z)|_(x|y|z){2})(?=_|$)", "", name) if "momentum" not in name else "momenta"


def scales(fields):
    result = {}
    for name, values in fields.items():
        finite = numpy.abs(values[numpy.isfinite(values)])
        result[group(name)] = max(result.get(group(name), 0.0), finite.max(initial=0.0))
    if "momenta" in result and "kinetic_energy" in fields:  # momenta of bodies that meet sum up to rounding
        result["momenta"] = max(result["momenta"], math.sqrt(2 * numpy.abs(fields["mass"] * fields["kinetic_energy"]).max()))
    return result


def largest_modulus(files):
    """Of the materials of a run, Pa; 0 where no case.toml says."""
    text = files.get("case.toml", b"").decode()
    return max((float(v) for v in re.findall(r"^(?:young|lambda|mu) = (\S+)", text, re.M)), default=0.0)


def scales_of_run(files, suffix):
    """The scales of all files of a kind together: the first frames may hold only round-off. Those of stresses and energies per
    volume are at least a modulus, because F is rounded relative to 1; those of energies are at least that of the whole volume."""
    modulus = largest_modulus(files)
    volumes = [vtk_fields(data)["volume"].sum() for name, data in files.items() if name.endswith(".vtu")]
    result  = dict.fromkeys(PER_VOLUME, modulus) | {"energies": modulus * max(volumes, default=0.0)}
    for name, data in files.items():
        if pathlib.Path(name).suffix == suffix:
            for key, value in scales(READERS[suffix](data)).items():
                result[key] = max(result.get(key, 0.0), value)
    return result


def difference(name, old, new, size):
    """The largest relative difference of two files, and its field."""
    a, b = READERS[pathlib.Path(name).suffix](old), READERS[pathlib.Path(name).suffix](new)
    if a.keys() != b.keys():
        return math.inf, "only one has " + ", ".join(sorted(a.keys() ^ b.keys()))
    worst, field = 0.0, ""
    for key, values in a.items():
        if values.shape != b[key].shape:
            return math.inf, f"{key} has {values.size} numbers, then {b[key].size}"
        same = (values == b[key]) | (numpy.isnan(values) & numpy.isnan(b[key]))
        if same.all():
            continue
        scale = 1.0 if "defect" in key else size[group(key)]
        with numpy.errstate(all="ignore"):
            largest = numpy.nan_to_num(numpy.abs(values - b[key])[~same], nan=math.inf).max() / (scale or 1.0)
        if largest >= worst:
            worst, field = largest, key
    return worst, field


def without_times(text):
    return re.sub(r'"\w*seconds\w*": [^,\n]*', "", text)


def echo(data):
    """Settings of case.toml: {table and its number: {key: value}}."""
    result, table = {}, "top"
    for line in data.decode().splitlines():
        if line.startswith("["):
            table = line
            while table in result:
                table += "+"
            result[table] = {}
        elif "=" in line and not line.startswith("#"):
            key, value = line.split(" = ", 1)
            result.setdefault(table, {})[key] = value
    return result


def echo_difference(old, new):
    a, b = echo(old), echo(new)
    return [f"{t} {k}" for t in a.keys() & b.keys() for k in a[t].keys() & b[t].keys() if a[t][k] != b[t][k]]


def compare(old, new):
    """The result for a run, and the largest relative difference."""
    code, message, files = old
    if code != new[0]:
        return f"exit code {code}, then {new[0]}: {(new[1] or message).strip()[:200]}", math.inf
    if files.keys() != new[2].keys():
        return "only one wrote " + ", ".join(sorted(files.keys() ^ new[2].keys())), math.inf
    if code and not files:
        first = message.strip().splitlines()[0][:110] if message.strip() else f"exit code {code}"
        return f"refused by both{'' if message == new[1] else ', with another message'}: {first}", 0.0
    worst, where, notes = 0.0, "", []
    for name, data in files.items():
        other = new[2][name]
        if data == other:
            continue
        if name.endswith(".toml"):
            if changed := echo_difference(data, other):
                worst, where = math.inf, f"{name}: {', '.join(changed)}"
            continue
        if name.endswith(".json") and without_times(data.decode()) == without_times(other.decode()):
            continue
        if pathlib.Path(name).suffix not in READERS:
            worst, where = math.inf, name
            continue
        size, field = difference(name, data, other, scales_of_run(files, pathlib.Path(name).suffix))
        notes.append(name)
        if size >= worst:
            worst, where = size, f"{field} in {name}"
    failed = f" (both end with exit code {code})" if code else ""
    if not where:
        return "same bytes" + failed, 0.0
    return f"{worst:.1e} of {where}, {len(notes)} of {len(files)} files{failed}", worst


def judge(run, options):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        try:
            results = [start(program, run, folder / which) for program, which in ((options.old, "old"), (options.new, "new"))]
        except subprocess.TimeoutExpired:
            return f"no end within {LIMIT} s", math.inf
        return compare(*results)


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--only", default="", help="words, separated by commas; runs whose name has one of them")
    parser.add_argument("--tolerance", type=float, default=1e-12, help="largest relative difference allowed (1e-12)")
    parser.add_argument("--verify-tolerance", type=float, default=1e-9, help="the same of studies of ordo verify (1e-9)")
    parser.add_argument("--jobs", type=int, default=2, help="runs side by side (2)")
    parser.add_argument("--list", action="store_true", help="print the names of the runs")
    return parser.parse_args()


def main():
    options = parse_options()
    for program in (options.old, options.new):
        if not pathlib.Path(program).is_file():
            print(f"compare_outputs: {program}: not there", file=sys.stderr)
            return 2
    options.old, options.new = str(pathlib.Path(options.old).resolve()), str(pathlib.Path(options.new).resolve())
    words = [w for w in options.only.split(",") if w]
    runs = [r for r in all_runs(presets_of(options.old)) if not words or any(w in r.name for w in words)]
    if options.list or not runs:
        print("\n".join(r.name for r in runs) or "compare_outputs: no run has such a name")
        return 0 if runs else 2
    bad = same = refused = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for run, (text, size) in zip(runs, pool.map(lambda r: judge(r, options), runs)):
            allowed = options.verify_tolerance if run.is_study else options.tolerance
            same, refused = same + text.startswith("same bytes"), refused + text.startswith("refused by both")
            bad += size > allowed
            print(f"{'DIFFERS' if size > allowed else 'ok':8}{run.name:44} {text}", flush=True)
    print(f"{len(runs)} runs: {same} same bytes, {refused} refused by both, {len(runs) - same - refused - bad} within the tolerance, "
          f"{bad} differ")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
