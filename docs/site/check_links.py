#!/usr/bin/python3
"""Checks a built site: each link leads to a file and an anchor of the site, and no page loads anything from elsewhere. The links between
the pages in cpp are left to Doxygen, which writes some to headings that it leaves out.

Usage: docs/site/check_links.py FOLDER
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit


class Page(HTMLParser):
    """The anchors, links and loaded files of a page."""

    def __init__(self, file):
        super().__init__()
        self.anchors, self.links, self.loads = {"", "top"}, [], []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors |= {given.get("id"), given.get("name")}
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        if tag in ("img", "script", "iframe", "source", "video") and given.get("src"):
            self.loads.append(given["src"])
        if tag == "link" and given.get("href") and given.get("rel") != "canonical":
            self.loads.append(given["href"])


def faults_of(folder):
    """What is wrong, a line each."""
    pages = {file: Page(file) for file in sorted(folder.rglob("*.html"))}
    for file, page in pages.items():
        if file.name == "404.html":  # served for any address: its links begin at the root
            continue
        for is_load, links in ((False, page.links if folder / "cpp" not in file.parents else []), (True, page.loads)):
            for link in links:
                if urlsplit(link).scheme or link.startswith("//"):
                    if is_load and re.match(r"(https?:)?//", link):
                        yield f"{file.relative_to(folder)}: loads {link} from the network"
                    continue
                address, anchor = urldefrag(link)
                target = (file.parent / unquote(urlsplit(address).path)).resolve() if address else file
                if not target.is_file():
                    yield f"{file.relative_to(folder)}: {link}: there is no such file"
                elif target in pages and unquote(anchor) not in pages[target].anchors:
                    yield f"{file.relative_to(folder)}: {link}: the page has no such anchor"


if __name__ == "__main__":
    found = list(faults_of(Path(sys.argv[1]).resolve()))
    print(*found, sep="\n", end="\n" if found else "")
    sys.exit(bool(found))
