"""Pieces of the page as HTML; ``page.css`` says how they look."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def note(text: str, *, is_bad: bool = False) -> str:
    """Return a text of its own."""
    return f'<div class="tri-glide-note{" bad" if is_bad else ""}">{escape(text)}</div>'


def code(text: str) -> str:
    """Return a line of a program."""
    return f'<div class="tri-glide-note tri-glide-code">{escape(text)}</div>' if text else ""


def table(rows: Iterable[Iterable[str]]) -> str:
    """Return a table; cells that begin with a tag are taken as they are."""
    return _table("".join(f"<td>{_cell(cell)}</td>" for cell in row) for row in rows)


def bar(part: float, *, is_much: bool = False) -> str:
    """Return a bar that is filled to a ``part`` of its length."""
    width = 100.0 * min(max(part, 0.0), 1.0)
    kind = ' class="much"' if is_much else ""
    return f'<div class="bar"><i{kind} style="width:{width:.0f}%"></i></div>'


def legend(colors: Iterable[Sequence[int]], least: str, largest: str) -> str:
    """Return a bar with ``colors`` from left to right, and what both of its ends mean."""
    stops = ", ".join(f"rgb({red} {green} {blue})" for red, green, blue in colors)
    ends = f"<span>{escape(least)}</span><span>{escape(largest)}</span>"
    return (
        f'<div class="tri-glide-legend"><i style="background:linear-gradient(90deg, {stops})"></i>'
        f"{ends}</div>"
    )


def _cell(text: str) -> str:
    return text if text.startswith("<div") else escape(text)


def _table(rows: Iterable[str]) -> str:
    cells = "".join(f"<tr>{row}</tr>" for row in rows)
    return f'<table class="tri-glide-numbers">{cells}</table>'
