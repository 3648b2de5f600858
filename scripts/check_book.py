"""Checks the built book: every link and picture of every page leads to a file and an anchor that exist, no page needs the
network, and every page of the documentation is in the table of contents. Usage: check_book.py FOLDER"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

DOCS = Path(__file__).resolve().parent.parent / "docs"


class Page(HTMLParser):
    """Links, resources and anchors of a page."""

    def __init__(self, path):
        super().__init__()
        self.path, self.links, self.resources, self.anchors = path, [], [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.anchors.update(values[key] for key in ("id", "name") if values.get(key))
        if tag == "a" and values.get("href"):
            self.links.append(values["href"])
        if tag in ("img", "script", "iframe") and values.get("src"):
            self.resources.append(values["src"])
        if tag == "link" and values.get("href") and values.get("rel") != "canonical":
            self.resources.append(values["href"])


def problems(page, pages):
    """What is wrong with the links of a page."""
    for target in page.links + page.resources:
        parts = urlsplit(target)
        if parts.scheme or parts.netloc:
            if target in page.resources and parts.scheme != "data":
                yield f"{page.path.name}: {target} needs the network"
            continue
        path = (page.path.parent / unquote(parts.path)).resolve() if parts.path else page.path
        if not path.exists():
            yield f"{page.path.name}: {target} leads nowhere"
        elif parts.fragment and path in pages and unquote(parts.fragment) not in pages[path].anchors:
            yield f"{page.path.name}: {target}: the page has no such heading"


def main():
    folder = Path(sys.argv[1]).resolve()
    # The page for printing repeats the others with links of its own; the page of errors stands at any address.
    paths = [path for path in folder.rglob("*.html") if path.name not in ("print.html", "404.html", "toc.html")]
    pages = {path: Page(path) for path in paths}
    found = [problem for page in pages.values() for problem in problems(page, pages)]
    listed = {path.relative_to(folder).with_suffix("") for path in paths}
    for page in sorted(DOCS.rglob("*.md")):
        name = page.relative_to(DOCS).with_suffix("")
        name = name.with_name("index") if name.name == "README" else name
        if name.name != "SUMMARY" and name not in listed:
            found.append(f"docs/{page.relative_to(DOCS)} is not in docs/SUMMARY.md")
    print("\n".join(found) if found else f"{len(pages)} pages, {sum(len(p.links) for p in pages.values())} links checked")
    sys.exit(bool(found))


main()
