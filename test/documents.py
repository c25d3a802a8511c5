"""The documents, and what stands in them."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    [
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        ROOT / "QUALITY_DECLARATION.md",
        ROOT / "SECURITY.md",
        ROOT / "examples" / "README.md",
        ROOT / "test" / "README.md",
        *(ROOT / "docs").rglob("*.md"),
    ]
)


def text(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def blocks(page: Path, language: str) -> list[str]:
    """Return the code of a language, without the indentation of lists."""
    return [code for named, code in all_blocks(page) if named == language]


def all_blocks(page: Path) -> list[tuple[str, str]]:
    """Return the language and the code of each block, in order."""
    found = re.findall(r"^( *)```(\w*)\n(.*?)^\1```", text(page), flags=re.DOTALL | re.MULTILINE)
    return [
        (language, re.sub(rf"^{indent}", "", code, flags=re.MULTILINE))
        for indent, language, code in found
    ]


def prose(page: Path) -> str:
    """Return the text without its code blocks."""
    return re.sub(r"^ *```.*?^ *```", "", text(page), flags=re.DOTALL | re.MULTILINE)


def commands(start: str) -> Iterator[list[str]]:
    """Yield the words behind ``start`` of each command in all pages that begins so."""
    for page in PAGES:
        for block in blocks(page, "bash"):
            for words in _split(block):
                if words[: len(start.split())] == start.split():
                    yield words[len(start.split()) :]


def anchors(page: Path) -> set[str]:
    """Return what links to headings of a page may name, as GitHub makes it."""
    headings = re.findall(r"^#+ (.+)$", prose(page), flags=re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading).strip().lower() for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


def _split(script: str) -> Iterator[list[str]]:
    """Yield the words of each command of a shell script; a quoted text may have several lines."""
    command = ""
    for line in script.replace("\\\n", " ").splitlines():
        command += line + "\n"
        try:
            words = shlex.split(command, comments=True)
        except ValueError:  # a quotation goes on in the next line
            continue
        command = ""
        if words:
            yield words
    assert not command, command
