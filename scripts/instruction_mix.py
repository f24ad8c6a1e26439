#!/usr/bin/env python3
"""What limits a pass: its instructions a particle and step, by kind, beside the cycles that it takes.

Runs `ordo bench` under callgrind, which counts every instruction (Valgrind knows AVX2, not AVX-512), looks up their kinds in the
disassembly, and again under `perf`, which samples the time of each function. Prints a Markdown table of the functions that take
most of a step:

- cycles, from the sampled time and the clock, which is the peak of `ordo bench` over 16 flops (two multiply-adds of four lanes);
- instructions, and those a cycle;
- multiply-adds and multiplications, additions and comparisons, divisions and square roots, all of vectors or scalars;
- loads and stores, also those that are part of another instruction; shuffles: what moves numbers between lanes; the rest:
  addresses, loops, integers;
- the bound: the cycles that the busiest unit of a Zen 3 core needs, and which it is: 2 multiply-adds, 2 additions, 2 loads of 32
  bytes, 1 store (2 of up to 8 bytes, which makes this bound too high for scalars), 2 shuffles or 6 instructions a cycle, 5
  cycles a division (AMD, Software Optimization Guide 56665);
- with --caches, lines of 64 bytes that are not in a first cache of 32 KiB and in a last of 32 MiB, as callgrind simulates them.

    scripts/instruction_mix.py build/release/ordo --dim 3 --method cpdi1
    scripts/instruction_mix.py build/release/ordo --dim 3 --method bsmpm --set mass=lumped --set scheme=usl
"""

import argparse
import collections
import json
import os
import pathlib
import re
import subprocess
import tempfile

KINDS = ("multiply", "add", "divide", "load", "store", "shuffle", "rest")
A_CYCLE = {"multiply": 2, "add": 2, "divide": 0.2, "load": 2, "store": 1, "shuffle": 2, "all": 6}
PATTERNS = [  # the first that matches the mnemonic; a move of memory has no kind of its own
    ("divide", r"v?(div|sqrt)[ps][sd]"),
    ("multiply", r"v?(fn?m(add|sub|addsub|subadd)\d*|mul)[ps][sd]"),
    ("shuffle", r"v?(perm\w*|p?unpck\w*|shuf\w*|pshuf\w*|insert\w*|extract\w*|p?blend\w*|broadcast\w*|pbroadcast\w*|movddup|mov[hl]p[sd]"
                r"|movlhps|movhlps|pinsr\w|pextr\w|palignr)"),
    ("add", r"v?(add|sub|addsub|max|min|cmp\w*|round|u?comi)[ps][sd]|v?cvt\w+"),
]
MOVES = re.compile(r"v?(mov(?!ddup|hlps|lhps|[hl]p[sd])\w*|lddqu|maskmov\w*)$|v?p?broadcast\w*$")
ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive"}  # the latter: ordo does not start itself again


def kinds_of(mnemonic, operands):
    """The kinds of an instruction of the disassembly, in AT&T syntax: sources first."""
    if re.match(r"nop|lea|endbr|data16|cs", mnemonic):
        return ["rest"]
    memory = [k for k, o in enumerate(operands) if "(" in o]
    kinds = [kind for kind, pattern in PATTERNS if re.fullmatch(pattern, mnemonic)][:1]
    if memory and MOVES.match(mnemonic):
        kinds = []
    if memory:
        is_last = memory[0] == len(operands) - 1 and not re.match(r"cmp|test|v?u?comi|bt", mnemonic)
        is_store = is_last and (len(operands) > 1 or re.match(r"set|inc|dec|neg|not|sh[lr]|sa[lr]", mnemonic))
        kinds.append("store" if is_store else "load")
        if is_store and not re.match(r"v?(mov|maskmov|extract|pextr)|set", mnemonic):
            kinds.append("load")  # reads, changes and writes
    elif re.match(r"push|call", mnemonic):
        kinds.append("store")
    elif re.match(r"pop|ret", mnemonic):
        kinds.append("load")
    return kinds or ["rest"]


def disassemble(program):
    """Kinds by address."""
    kinds = {}
    lines = subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], check=True, stdout=subprocess.PIPE, text=True).stdout
    for line in lines.splitlines():
        if m := re.match(r"\s*([0-9a-f]+):\t(\S+)\s*([^#<]*)", line):
            operands = re.split(r",(?![^(]*\))", m[3].strip()) if m[3].strip() else []
            kinds[int(m[1], 16)] = kinds_of(m[2], operands)
    return kinds


def count(program, arguments, folder, has_caches):
    """Executions of each instruction of the program, by function, and the misses of each function in the first and last cache."""
    out = folder / "callgrind.out"
    caches = ["--cache-sim=yes", "--D1=32768,8,64", "--LL=33554432,16,64"] if has_caches else []
    subprocess.run(["valgrind", "--tool=callgrind", "--dump-instr=yes", "--demangle=no", "--compress-strings=no", "--compress-pos=no", *caches,
                    f"--callgrind-out-file={out}", program, *arguments], check=True, env=ENVIRONMENT, capture_output=True)
    counts, misses = collections.defaultdict(collections.Counter), collections.Counter()
    function, is_own, is_call, events = None, True, False, []
    for line in out.read_text(errors="replace").splitlines():
        if line.startswith("events:"):
            events = line.split()[1:]
        elif line.startswith("ob="):
            is_own = os.path.basename(line) == os.path.basename(program) or line.endswith("???")
        elif line.startswith("fn="):
            function = line[3:]
        elif line.startswith("calls="):
            is_call = True
        elif line.startswith("0x"):
            address, _, *numbers = line.split()  # zeros at the end are left out
            if not is_call and is_own:
                cost = dict(zip(events, map(int, numbers)))
                counts[function][int(address, 16)] += cost.get("Ir", 0)
                for cache in ("D1", "DL"):
                    misses[function, cache] += cost.get(cache + "mr", 0) + cost.get(cache + "mw", 0)
            is_call = False
    return counts, misses


def sample(program, arguments, folder):
    """Seconds that each function took."""
    data = folder / "perf.data"
    subprocess.run(["perf", "record", "-q", "-F", "4000", "-e", "cpu-clock:u", "-o", data, program, *arguments], check=True,
                   env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    report = subprocess.run(["perf", "report", "-i", data, "--stdio", "-F", "period,sym", "--no-children", "--no-demangle"], check=True,
                            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout
    found = re.findall(r"^\s*(\d+)\s+\[\.\]\s+(.*?)\s*$", report, re.MULTILINE)
    return {name: 1e-9 * int(period) for period, name in found}  # of cpu-clock in nanoseconds


def short(name):
    """A function without its return type, parameters and namespaces."""
    name = subprocess.run(["c++filt", name], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    name = name.replace("ordo::", "").replace("(anonymous namespace)::", "").removeprefix("void ")
    return re.sub(r"\(.*", "", name)[:60]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--particles", type=int, default=100000, help="of the timed run")
    parser.add_argument("--counted", type=int, default=10000, help="particles of the run under callgrind")
    parser.add_argument("--caches", action="store_true")
    parser.add_argument("--least", type=float, default=0.03, help="smallest share of the time of a function in the table")
    chosen, bench = parser.parse_known_args()
    program = str(pathlib.Path(chosen.program).resolve())
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        timed = folder / "timed.json"

        def arguments(particles, steps):
            return ["bench", *bench, "--threads", "1", "--repeat", "1", "--particles", str(particles), "--steps", str(steps), "--json", str(timed)]

        subprocess.run([program, *arguments(chosen.particles, 1)], check=True, env=ENVIRONMENT, stdout=subprocess.DEVNULL)
        one = json.loads(timed.read_text())
        steps = max(2, round(4 * one["particle_steps_per_second"] / one["particles"]))
        seconds = sample(program, arguments(chosen.particles, steps), folder)
        of_time = json.loads(timed.read_text())
        counts, misses = count(program, arguments(chosen.counted, 2), folder, chosen.caches)
        of_count = json.loads(timed.read_text())
    kinds = disassemble(program)
    clock = of_time["peak_gflops"] / 16
    per_time, per_count = of_time["particles"] * (steps + 1), of_count["particles"] * 3  # each with the step before the timed ones
    ns = {f: 1e9 * s / per_time for f, s in seconds.items() if f in counts}
    least = chosen.least * 1e9 / of_time["particle_steps_per_second"]
    print(f"{' '.join(bench)}: {1e9 / of_time['particle_steps_per_second']:.0f} ns a particle and step, {clock:.2f} GHz\n")
    columns = ["function", "ns", "cycles", "instructions", "a cycle", *KINDS, "bound"] + ["first cache", "last cache"] * chosen.caches
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    for f in sorted(ns, key=ns.get, reverse=True):
        if ns[f] < least or re.search(r"peak_flops|triad|start_stresses|fill_box|measure_ceilings", f):
            continue
        mix = collections.Counter()
        for address, executions in counts[f].items():
            for kind in kinds.get(address, ["rest"]):
                mix[kind] += executions / per_count
            mix["all"] += executions / per_count
        bounds = {kind: mix[kind] / A_CYCLE[kind] for kind in A_CYCLE}
        busiest = max(bounds, key=bounds.get)
        cycles = ns[f] * clock
        print(f"| `{short(f)}` | {ns[f]:.1f} | {cycles:.0f} | {mix['all']:.0f} | {mix['all'] / cycles:.1f} | "
              + " | ".join(f"{mix[k]:.0f}" for k in KINDS) + f" | {bounds[busiest]:.0f}, {busiest} |"
              + "".join(f" {misses[f, cache] / per_count:.1f} |" for cache in ("D1", "DL") if chosen.caches))


if __name__ == "__main__":
    main()
