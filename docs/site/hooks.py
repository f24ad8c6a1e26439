"""What MkDocs does beyond mkdocs.yml: the repository's pages under their own names, the pages of the Python API, search without a server."""

import json
import logging
import os
import posixpath
import re
import sys
import warnings
from pathlib import Path

from mkdocs.structure.files import File, Files
from mkdocs.structure.nav import Link, Section

from nbconvert import MarkdownExporter
from traitlets.config import Config

sys.path.insert(0, str(Path(__file__).parent))
import python_api  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
KATEX = Path("/usr/share/javascript/katex")
API = "docs/python-api.md"
NOTEBOOKS = "python/notebooks/*.ipynb"
log = logging.getLogger("mkdocs.ordo")  # below mkdocs: its warnings end a strict build


def title_of(page):
    """The first heading of a page."""
    return re.search(r"^# (.*)", page.read_text(encoding="utf-8"), re.MULTILINE)[1]


def on_config(config):
    cases = [{title_of(page): page.relative_to(ROOT).as_posix()} for page in sorted(ROOT.glob("cases/*/README.md"))]
    config["nav"] = [{name: cases if pages == "cases/" else pages} for entry in config["nav"] for name, pages in entry.items()]
    return config


def on_files(files, config):
    def file(name, source):
        made = File(name, str(ROOT), config["site_dir"], config["use_directory_urls"])
        made.abs_src_path = str(source)
        return made

    docs = Path(config["docs_dir"])
    sources = {f"docs/{f.src_path}": docs / f.src_path for f in files if Path(f.abs_src_path).is_relative_to(docs)}
    sources = {name: source for name, source in sources.items() if source.suffix in (".md", ".png", ".css", ".js")}
    for pattern in ("*.md", "python/README.md", "cases/*/README.md", "cases/*/*.png"):
        sources |= {source.relative_to(ROOT).as_posix(): source for source in ROOT.glob(pattern)}
    if not (KATEX / "katex.min.js").is_file():
        raise SystemExit(f"{KATEX}: there is no KaTeX for the formulas; install libjs-katex and fonts-katex")
    sources |= {f"assets/katex/{name}": KATEX / name for name in ("katex.min.js", "katex.min.css")}
    sources |= {f"assets/katex/fonts/{font.name}": font for font in (KATEX / "fonts").glob("*.woff2")}
    sources[API] = ROOT / "python/ordo/__init__.py"
    sources |= {source.relative_to(ROOT).with_suffix(".md").as_posix(): source for source in ROOT.glob(NOTEBOOKS)}
    theme = [f for f in files if not Path(f.abs_src_path).is_relative_to(docs)]
    return Files(theme + [file(name, source) for name, source in sorted(sources.items())])


def on_nav(nav, config, files):
    named = {page.file.src_path for page in nav.pages}
    for f in files.documentation_pages():
        if f.src_path not in named:
            log.warning("%s is not in the navigation; add it to nav in mkdocs.yml", f.src_path)
    if "ORDO_SITE_CPP" in os.environ:  # scripts/site.sh adds them
        reference = next(one for one in nav.items if isinstance(one, Section) and one.title == "Reference")
        after = [page.title for page in reference.children].index("C++ API") + 1
        reference.children.insert(after, Link("C++ headers", "cpp/files.html"))
    return nav


def on_page_read_source(page, config):
    source = Path(page.file.abs_src_path)
    return python_api.page() if page.file.src_path == API else of_notebook(source) if source.suffix == ".ipynb" else None


def of_notebook(source):
    """Its texts, code and outputs, with the figures in the page."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the libraries, about each other
        text, _ = MarkdownExporter(config=Config({"ExtractOutputPreprocessor": {"enabled": False}})).from_filename(str(source))
    return text.replace("![png](", "![A figure of this notebook](")


def on_page_markdown(markdown, page, config, files):
    """Links to folders lead to their README; texts that are the name of a page become its title; links to files that are not part of the
    site leave their text."""
    here = posixpath.dirname(page.file.src_path)
    if page.is_homepage:
        page.meta["hide"] = ["navigation"]

    def link(match):
        text, target, anchor = match.groups()
        path = posixpath.normpath(posixpath.join(here, target)).replace(".ipynb", ".md")
        if files.get_file_from_path(f"{path}/README.md"):
            return f"[{text}]({target.rstrip('/')}/README.md{anchor})"
        if not files.get_file_from_path(path):
            return text if (ROOT / path).exists() else match[0]
        is_name = text.endswith(".md") and posixpath.basename(text) == posixpath.basename(path)
        return f"[{title_of(ROOT / path) if is_name else text}]({target.replace('.ipynb', '.md')}{anchor})"

    lines, is_code = markdown.split("\n"), False
    for k, line in enumerate(lines):
        is_code ^= line.lstrip().startswith("```")
        if not is_code and not line.startswith("    "):
            line = re.sub(r"^  (?=- )", "    ", line)  # nested lists: Python's Markdown wants four spaces
            lines[k] = re.sub(r"(?<!!)\[((?:`[^`]*`|[^][])*)\]\(((?!\w+:)[^)#\s]+)(#[^)\s]*|)\)", link, line)
    return "\n".join(lines)


def on_post_build(config):
    """A page that was opened from a folder may not fetch: it takes the index of the search as a script."""
    folder = Path(config["site_dir"]) / "search"
    index = json.loads((folder / "search_index.json").read_text(encoding="utf-8"))
    (folder / "search_index.js").write_text(f"window.ordoSearchIndex = {json.dumps(index, separators=(',', ':'))};", encoding="utf-8")
