"""What is known of the site without Sphinx: contents, reference, the check of its links."""

import importlib.util
import sys
from importlib import import_module
from pathlib import Path

import pytest
from documents import PAGES, ROOT, text

import tri_glide_kinematics

DOCS = ROOT / "docs"


def _module(name: str):
    spec = importlib.util.spec_from_file_location(f"site_{name}", DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    path = list(sys.path)
    spec.loader.exec_module(module)
    sys.path[:] = path
    return module


conf, check_site = _module("conf"), _module("check_site")


def test_each_page_stands_in_the_contents_once():
    sections = conf.contents(text(DOCS / "index.md"))
    listed = [(DOCS / page).resolve() for _, pages in sections for page in pages]
    assert all(sections)
    pages = [*PAGES, ROOT / "CHANGELOG.md"]
    assert sorted(listed) == sorted(page for page in pages if page != DOCS / "index.md")


def test_the_reference_shows_each_public_name_once():
    shown = [
        getattr(import_module(room), name) for room, names in conf.rooms().items() for name in names
    ]
    assert len({id(value) for value in shown}) == len(shown)
    for name in tri_glide_kinematics.__all__:
        assert any(value is getattr(tri_glide_kinematics, name) for value in shown), name


def test_a_page_of_the_reference_shows_classes_before_errors():
    room = "tri_glide_kinematics.workspace"
    page = conf.reference_page(room, ["OutsideWorkspaceError", "Workspace"])
    assert page.startswith(f"workspace\n=========\n\n.. automodule:: {room}\n")
    shown = [line for line in page.splitlines() if line.startswith(".. auto")][1:]
    assert shown == [
        f".. autoclass:: {room}.Workspace",
        f".. autoexception:: {room}.OutsideWorkspaceError",
    ]


def _site(folder: Path, page: str) -> list[str]:
    (folder / "part").mkdir()
    (folder / "part" / "other.html").write_text('<h1 id="here">here</h1>')
    (folder / "style.css").write_text("a { color: red }")
    (folder / "page.html").write_text(page)
    return check_site.faults_of(folder)[0]


@pytest.mark.parametrize(
    "page",
    [
        '<a href="part/other.html#here">there</a>',
        '<a id="top" href="#top">up</a><link rel="stylesheet" href="style.css?digest">',
        '<a href="https://semver.org/">elsewhere</a>',
        '<img src="data:image/png;base64,AA==">',
    ],
)
def test_good_links_are_taken(page, tmp_path):
    assert _site(tmp_path, page) == []


@pytest.mark.parametrize(
    ("page", "fault"),
    [
        ('<a href="part/none.html">there</a>', "no file"),
        ('<a href="part/other.html#gone">there</a>', "no anchor"),
        ('<a href="#gone">there</a>', "no anchor"),
        ('<a href="https://no address/">there</a>', "no address"),
        ('<script src="https://cdn.example.org/mathjax.js"></script>', "loads"),
        ('<link rel="stylesheet" href="//fonts.example.org/font.css">', "loads"),
        ("<style>@import url(https://fonts.example.org/a.css)</style>", "loads"),
        ('<img srcset="a.png 1x, http://example.org/b.png 2x">', "loads"),
    ],
)
def test_bad_links_are_told(page, fault, tmp_path):
    (tmp_path / "a.png").touch()
    assert [fault in each for each in _site(tmp_path, page)] == [True]


def test_a_style_that_loads_a_font_from_elsewhere_is_told(tmp_path):
    (tmp_path / "font.css").write_text('@font-face { src: url("https://example.org/f.woff2") }')
    assert check_site.faults_of(tmp_path)[0] == ["font.css: loads https://example.org/f.woff2"]
