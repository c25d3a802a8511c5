"""How Sphinx makes a site of the pages of this clone, for ``make docs``.

The sources are the pages where they stand, so a link leads to the same place on the site and in a
viewer of the repository. The tables of ``docs/index.md`` are the contents of the site. The
reference is made from the public names of the rooms and their docstrings.
"""

from __future__ import annotations

import re
import sys
from enum import Enum
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

PACKAGE = "tri_glide_kinematics"
REFERENCE = ROOT / "docs" / "reference"  # made here, not kept
# Rooms for users, outer ones before inner ones: a name is shown in the first room that has it. What
# the package itself exports is mostly theirs. Rooms that need ROS are not among them.
ROOMS = (
    f"{PACKAGE}.tri_glide",
    f"{PACKAGE}.workspace",
    f"{PACKAGE}.motion",
    f"{PACKAGE}.motion.shaping",
    f"{PACKAGE}.dynamics",
    f"{PACKAGE}.calibration",
    f"{PACKAGE}.calibration.ringdown",
    f"{PACKAGE}.programs",
    f"{PACKAGE}.recordings",
    f"{PACKAGE}.sizing",
    f"{PACKAGE}.figures",
    f"{PACKAGE}.mechanisms",
    f"{PACKAGE}.mechanisms.four_bar",
    f"{PACKAGE}.mechanisms.f_mechanism",
    f"{PACKAGE}.mechanisms.landing_gear",
    f"{PACKAGE}.mechanisms.pictures",
    PACKAGE,
)

project = PACKAGE
author = copyright = f"{PACKAGE} maintainers"
version = release = import_module(PACKAGE).__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx.ext.napoleon"]

root_doc = "docs/index"
include_patterns = ["*.md", "docs/**", "examples/README.md", "test/README.md"]
exclude_patterns = [".*", "build", "install", "log", "out"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4  # as viewers of repositories make them

html_theme = "furo"
html_title = f"tri-glide kinematics {version}"
html_copy_source = False
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_show_sphinx = False
mathjax_path = "tex-svg-full.js"
mathjax3_config = {"options": {"enableMenu": False}}

autoclass_content = "both"
autodoc_default_options = {"show-inheritance": True}
autodoc_type_aliases = {name: name for name in ("ArrayLike", "FloatArray", "Vector3")}
napoleon_use_ivar = True
maximum_signature_line_length = 88
# The pages of other projects cannot be reached, so only names of this package are looked for.
nitpick_ignore_regex = [(r"py:.*", rf"(?!{PACKAGE}\.).*")]


def contents(index: str) -> list[tuple[str, list[str]]]:
    """Return the title of each section of ``docs/index.md`` and the pages in its table."""
    sections = re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", index, flags=re.DOTALL | re.MULTILINE)
    return [(title, re.findall(r"^\| \[.*?\]\((.+?)\)", text, re.M)) for title, text in sections]


def rooms() -> dict[str, list[str]]:
    """Return the rooms of the reference with their names, each in the first room that has it."""
    found: dict[str, list[str]] = {}
    shown: set[int] = set()
    for room in ROOMS:
        module = import_module(room)
        own = [name for name, value in vars(module).items() if _is_of(value, room)]
        names = [name for name in getattr(module, "__all__", own)]
        found[room] = [name for name in names if id(getattr(module, name)) not in shown]
        shown.update(id(getattr(module, name)) for name in names)
    return found


def _is_of(value: object, module: str) -> bool:
    name = getattr(value, "__name__", "_")
    return getattr(value, "__module__", "") == module and not name.startswith("_")


def reference_page(room: str, names: list[str]) -> str:
    """Return the page of a room: what can be made, what can be called, what can go wrong."""
    module = import_module(room)
    groups: dict[str, list[str]] = {"class": [], "function": [], "exception": [], "data": []}
    for name in names:
        value = getattr(module, name)
        groups[_kind(value)].append(name)
    title = room.removeprefix(f"{PACKAGE}.")
    parts = [f"{title}\n{'=' * len(title)}\n\n.. automodule:: {room}\n"]
    if room == PACKAGE:
        parts += [_list_of_rooms(), "Errors that all rooms share\n" + 27 * "-" + "\n"]
    for kind, members in groups.items():
        options = "" if kind in ("function", "data") else "   :members:\n"
        parts += [f".. auto{kind}:: {room}.{name}\n{options}" for name in members]
    return "\n".join(parts)


def _list_of_rooms() -> str:
    """Return a list of the rooms: what each is, and which names of the package are from there."""
    public = set(import_module(PACKAGE).__all__)
    lines = []
    for room, names in rooms().items():
        if room != PACKAGE:
            meaning = (import_module(room).__doc__ or "").split("\n\n")[0].replace("\n", " ")
            own = ", ".join(f":py:obj:`~{room}.{name}`" for name in names if name in public)
            lines.append(f"- :doc:`{room}`: {meaning}" + (f" {own}" if own else ""))
    return "\n".join(lines) + "\n"


def _kind(value: object) -> str:
    if isinstance(value, type):
        return "exception" if issubclass(value, Exception) else "class"
    return "function" if callable(value) and hasattr(value, "__code__") else "data"


def _bring_mathjax(app: Any) -> None:
    """Make formulas independent of the network: this file has all letters and commands in it."""
    spec = find_spec("sphinx-mathjax-offline")
    assert spec is not None and spec.submodule_search_locations
    folder = Path(spec.submodule_search_locations[0], "static", "mathjax")
    app.config.html_static_path.append(str(folder / mathjax_path))


def _write_reference(app: Any) -> None:
    REFERENCE.mkdir(exist_ok=True)
    for old in REFERENCE.glob("*.rst"):
        old.unlink()
    for room, names in rooms().items():
        file = REFERENCE / f"{room}.rst"
        file.write_text(reference_page(room, names), encoding="utf-8")


def _add_contents(app: Any, page: str, source: list[str]) -> None:
    """Make the contents of the site from the tables of its first page."""
    if page != root_doc:
        return
    sections = contents(source[0])
    reference = [f"reference/{room}" for room in (PACKAGE, *ROOMS[:-1])]
    for title, pages in [*sections, ("Reference", reference)]:
        entries = "\n".join(pages)
        source[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n{entries}\n```\n"


def _block_of(formula: re.Match[str]) -> str:
    return "\n.. math:: " + " ".join(formula[1].split()) + "\n"


def _formulas(app: Any, what: str, name: str, of: Any, options: Any, lines: list[str]) -> None:
    """Write formulas as reStructuredText has them: in docstrings they stand as in the pages."""
    if what == "data" and of.__doc__ == type(of).__doc__:
        lines.clear()  # what its class says is no text about this value
    text = re.sub(r"\$\$([^$]+)\$\$", _block_of, "\n".join(lines))
    text = re.sub(r"\$([^$]+)\$", r":math:`\1`", text)
    lines[:] = text.splitlines()


def _as_it_stands(app: Any, tree: Any) -> None:
    """Leave formulas as they are: Sphinx would align those of several lines, and refuse tags."""
    for formula in tree.findall(lambda node: node.tagname == "math_block"):
        formula["nowrap"] = True
        formula.children[:] = [type(formula.children[0])(rf"\[{formula.astext()}\]")]


def _is_left_out(app: Any, what: str, name: str, member: Any, left: bool, options: Any) -> Any:
    """Show members of enumerations; leave out fields of tuples, which the class explains."""
    if isinstance(member, Enum):
        return False
    return True if type(member).__name__ == "_tuplegetter" else None


@cache
def _public_names() -> dict[str, str]:
    """Return the public name of each object by the name that it has in its module."""
    return {
        f"{member.__module__}.{member.__qualname__}": f"{room}.{name}"
        for room, names in rooms().items()
        for name in names
        if hasattr(member := getattr(import_module(room), name), "__qualname__")
    }


def _link_to_room(app: Any, env: Any, node: Any, text: Any) -> Any:
    """Lead from the module of an object to the room that shows it."""
    name = node.get("reftarget", "")
    if node.get("refdomain") != "py" or not name.startswith(PACKAGE):
        return None
    if target := _public_names().get(name):
        domain = env.get_domain("py")
        return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", target, node, text)
    module, _, member = name.rpartition(".")
    # What is there, and is not for users, has no page.
    return text if find_spec(module) and hasattr(import_module(module), member) else None


def _lead_to_first_page(app: Any, error: Exception | None) -> None:
    """Have the root of the site lead to its first page, which has the address that it has here."""
    if error is None:
        (Path(app.outdir) / "index.html").write_text(
            f'<!DOCTYPE html><meta charset="utf-8"><title>{project}</title>'
            f'<meta http-equiv="refresh" content="0; url={root_doc}.html">'
            f'<a href="{root_doc}.html">{project}</a>\n',
            encoding="utf-8",
        )


def setup(app: Any) -> None:
    """Connect all of the above with Sphinx."""
    app.connect("config-inited", lambda app, config: _bring_mathjax(app))
    app.connect("builder-inited", _write_reference)
    app.connect("source-read", _add_contents)
    app.connect("autodoc-process-docstring", _formulas)
    app.connect("doctree-read", _as_it_stands)
    app.connect("autodoc-skip-member", _is_left_out)
    app.connect("missing-reference", _link_to_room)
    app.connect("build-finished", _lead_to_first_page)
