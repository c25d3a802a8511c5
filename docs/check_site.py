"""Checks the site that ``make docs`` has made: ``python docs/check_site.py out/docs``.

Each link inside the site leads to a file and an anchor that are there, and no page loads anything
from elsewhere. Links to other sites cannot be followed without a network: their form is checked,
and they are written to ``external_links.txt`` in the folder of the site.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What a browser loads by itself, without a click.
LOADED = {
    "audio": "src",
    "embed": "src",
    "iframe": "src",
    "img": "src",
    "input": "src",
    "link": "href",
    "object": "data",
    "script": "src",
    "source": "src",
    "video": "src",
}
LOADED_BY_STYLES = re.compile(r"""(?:url\(|@import)\s*['"]?\s*((?:https?:)?//[^'")\s]+)""")


class Page(HTMLParser):
    """What a page leads to, what it loads, and its anchors."""

    def __init__(self, html: str) -> None:
        """Read ``html``."""
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.feed(html)
        self.loaded += LOADED_BY_STYLES.findall(html)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        """Note what a tag names."""
        values = {name: value for name, value in attributes if value}
        self.anchors.update(values[name] for name in ("id", "name") if name in values)
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if LOADED.get(tag) in values:
            self.loaded.append(values[LOADED[tag]])
        if "srcset" in values:
            self.loaded += [part.split()[0] for part in values["srcset"].split(",")]


def is_elsewhere(address: str) -> bool:
    """Tell whether an address is on another site; data in the page itself is not."""
    parts = urlsplit(address)
    return bool(parts.netloc) or parts.scheme not in ("", "data")


def faults_of(site: Path) -> tuple[list[str], set[str]]:
    """Return what is wrong in the ``site``, and all links to other sites."""
    pages = {file: Page(file.read_text(encoding="utf-8")) for file in sorted(site.rglob("*.html"))}
    outside: set[str] = set()
    faults = []
    for file, page in pages.items():
        name = file.relative_to(site)
        faults += [f"{name}: loads {each}" for each in page.loaded if is_elsewhere(each)]
        outside.update(each for each in page.links if is_elsewhere(each))
        inside = [each for each in (*page.links, *page.loaded) if not is_elsewhere(each)]
        faults += [f"{name}: {fault}" for fault in _lost(file, inside, pages)]
    for file in sorted(site.rglob("*.css")):
        loaded = LOADED_BY_STYLES.findall(file.read_text(encoding="utf-8"))
        faults += [f"{file.relative_to(site)}: loads {each}" for each in loaded]
    faults += [f"no address: {each}" for each in sorted(outside) if not _has_form(each)]
    return faults, outside


def _lost(file: Path, addresses: list[str], pages: dict[Path, Page]) -> Iterator[str]:
    for address in addresses:
        parts = urlsplit(address)
        target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
        if parts.scheme == "data":
            continue
        if not target.is_file():
            yield f"no file: {address}"
        elif parts.fragment and target in pages:
            if unquote(parts.fragment) not in pages[target].anchors:
                yield f"no anchor: {address}"


def _has_form(address: str) -> bool:
    parts = urlsplit(address)
    if parts.scheme == "mailto":
        return "@" in parts.path
    return parts.scheme in ("http", "https") and re.fullmatch(r"[\w.:-]+", parts.netloc) is not None


def main(arguments: list[str]) -> int:
    """Check the site in a folder; return 1 if something is wrong."""
    site = Path(arguments[0]).resolve()
    faults, outside = faults_of(site)
    (site / "external_links.txt").write_text("".join(f"{each}\n" for each in sorted(outside)))
    print("\n".join(faults), end="\n" if faults else "")
    print(f"{site}: {len(faults)} faults; links to other sites: {len(outside)}, not followed")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
