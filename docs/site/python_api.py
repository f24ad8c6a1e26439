"""The page of the Python API: signatures of the stub, texts of the docstrings."""

import ast
import inspect
import re

GROUPS = {"Cases": ["Case"], "Simulations": ["Simulation", "Particles", "Grid", "Nodes", "View"], "Laws": ["material"],
          "Results and verification": ["history", "frames", "Frames", "Frame", "verify"],
          "What there is": ["methods", "materials", "cases", "schema"],
          "Errors and warnings": ["InputError", "NumericalError", "OutputError", "StaleView", "InstabilityWarning"]}


def stub():
    """The signatures of the stub: of functions and classes by name, of members by Class.name."""
    import ordo

    with open(re.sub(r"py$", "pyi", ordo.__file__), encoding="utf-8") as text:
        tree = ast.parse(text.read())
    found = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = call(node, node.name)
        if isinstance(node, ast.ClassDef):
            found[node.name] = f"class {node.name}" + (f"({', '.join(map(ast.unparse, node.bases))})" if node.bases else "")
            for one in node.body:
                if isinstance(one, ast.FunctionDef):
                    is_property = any(ast.unparse(d) == "property" for d in one.decorator_list)
                    if one.name == "__init__":
                        found[node.name] = call(one, node.name).removesuffix(" -> None")
                    found[f"{node.name}.{one.name}"] = f"{one.name}: {ast.unparse(one.returns)}" if is_property else call(one, one.name)
    return found


def call(node, name):
    """A signature in a line, or a line for each argument where that is long."""
    arguments = ast.parse("def f(): ...").body[0].args
    arguments.__dict__.update(node.args.__dict__)
    arguments.args = [a for a in node.args.args if a.arg not in ("self", "cls")]
    each = ast.unparse(arguments).replace("=", " = ")
    text = f"{name}({each}) -> {ast.unparse(node.returns)}"
    if len(text) <= 110:
        return text
    parts = re.split(r", (?=\w+: |\*(?:, |\*))", each)
    return f"{name}(\n" + "".join(f"    {part},\n" for part in parts) + f") -> {ast.unparse(node.returns)}"


def markdown(docstring):
    """Docstrings are Markdown but for the headings and lists of numpydoc and `::` before code."""
    text = re.sub(r"^(\w+)\n-+$", r"**\1**\n", docstring, flags=re.MULTILINE)
    text = re.sub(r"::$", ":", text, flags=re.MULTILINE)
    lines, out = text.split("\n"), []
    for k, line in enumerate(lines):
        name, _, kind = line.partition(" : ")
        is_entry = re.match(r"\w", line) and (kind or re.fullmatch(r"\w+", line)) and k + 1 < len(lines) and re.match(r"    \S", lines[k + 1])
        if is_entry:
            out += [""] * (k > 0 and lines[k - 1] != "")
            out.append(f"- `{name}`" + (f", {kind}:" if kind else ":"))
        else:
            out.append(line)
    return "\n".join(out)


def members(item):
    """Public members with docstrings, in the order of the source, without those that numpy's and Python's classes have."""
    return [(name, one) for name, one in vars(item).items() if not name.startswith("_") and not any(hasattr(base, name) for base in item.__bases__)
            and inspect.getdoc(one)]


def page():
    try:
        import ordo
    except ImportError as e:
        raise SystemExit(f"python-api.md is made of the Python module, which cannot be imported ({e}); build it "
                         "(cmake --build --preset release) and set PYTHONPATH=build/release/python") from None
    signatures = stub()
    grouped = [name for names in GROUPS.values() for name in names]
    more = {"More": [name for name in ordo.__all__ if name not in grouped]}
    out = ["# Python API", "", f"Every public name of `import ordo`, version {ordo.__version__}. [Python](python.md) shows how they are used.", ""]
    for group, names in (GROUPS | more).items():
        names = [name for name in names if name in ordo.__all__]
        out += [f"## {group}", ""] if names else []
        for name in names:
            item = getattr(ordo, name)
            signature = signatures.get(name) or f"{name}{inspect.signature(item)}"
            out += [f"### {name}", "", "```python", signature, "```", "", markdown(inspect.getdoc(item)), ""]
            for member, one in members(item) if inspect.isclass(item) else ():
                out += [f"#### {name}.{member}", "", "```python", signatures[f"{name}.{member}"], "```", "", markdown(inspect.getdoc(one)), ""]
    return "\n".join(out)
