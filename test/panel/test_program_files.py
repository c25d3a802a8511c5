"""Files that pages send: what becomes a program of the folder, and what does not."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace

import pytest
from viser import _messages as messages

from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.programs import (
    LARGEST,
    NO_FILE,
    PIECE,
    PIECES_AHEAD,
    ProgramFileError,
    ProgramFolder,
    Uploads,
)

OPERATOR, OTHER = 0, 1
CONTENT = os.urandom(3 * PIECE + 17)


class Desk:
    """Two pages that send files, of which the first has the controls."""

    def __init__(self, folder: Path) -> None:
        self.folder = ProgramFolder(folder)
        self.requests = OperatorRequests(SimpleNamespace(), SimpleNamespace(gui=None))  # type: ignore[arg-type]
        for page in (OPERATOR, OTHER):
            self.requests.controls.opened(page)
        self.asked: list[tuple[int, str, int]] = []
        self.files: list[str] = []
        self.uploads = Uploads(self.folder, self.requests, lambda *told: self.asked.append(told))
        self.uploads.on_file = self.files.append

    def begin(self, name: object, size: object, page: int = OPERATOR, key: str = "k") -> str:
        self.requests.refusal = ""
        start = messages.FileTransferStartUpload("", key, name, "", 1, size)  # type: ignore[arg-type]
        self.uploads.take(page, start)
        return self.requests.refusal

    def send(self, index: int, content: object, page: int = OPERATOR, key: str = "k") -> str:
        part = messages.FileTransferPart("", key, index, content)  # type: ignore[arg-type]
        self.uploads.take(page, part)
        return self.requests.refusal

    def send_all(self, content: bytes) -> None:
        for index, first in enumerate(range(0, len(content), PIECE)):
            assert not self.send(index, content[first : first + PIECE])
        self.requests.fulfil()


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "programs")


def test_a_file_comes_in_pieces_that_are_asked_for(desk: Desk) -> None:
    assert not desk.begin("part.ngc", len(CONTENT))
    assert desk.asked == [(OPERATOR, "k", PIECES_AHEAD)]
    assert desk.folder.names() == []
    desk.send_all(CONTENT)
    assert desk.asked[-1] == (OPERATOR, "k", 3 + PIECES_AHEAD)
    assert desk.files == desk.folder.names() == ["part.ngc"]
    assert desk.folder.path("part.ngc").read_bytes() == CONTENT
    assert desk.uploads.text == ""
    # Another one of this name takes its place, all at once.
    desk.begin("part.ngc", 3)
    assert desk.folder.path("part.ngc").read_bytes() == CONTENT
    desk.send_all(b"M2\n")
    assert desk.folder.path("part.ngc").read_bytes() == b"M2\n"
    assert [each.name for each in desk.folder.folder.iterdir()] == ["part.ngc"]


@pytest.mark.parametrize(
    "name",
    [
        "",
        "../x.ngc",
        "/etc/passwd",
        "a/b",
        "a\\b",
        "..",
        ".hidden",
        "a\0b",
        "a\nb",
        "é" * 61,
        7,
        NO_FILE,
    ],
)
def test_names_that_no_file_may_have(desk: Desk, name: object) -> None:
    assert "not uploaded" in desk.begin(name, 10)
    assert not desk.asked
    assert not desk.folder.folder.exists()


def test_a_file_that_is_called_like_the_choice_of_none_is_not_in_the_list(desk: Desk) -> None:
    desk.folder.folder.mkdir()
    (desk.folder.folder / NO_FILE).write_bytes(CONTENT)
    assert desk.folder.names() == []


@pytest.mark.parametrize(
    ("size", "reason"),
    [
        (0, "x.ngc is empty"),
        (200_000_000, "x.ngc has 200.0 MB, at most 100 MB"),
        (LARGEST + 1, "at most 100 MB"),
        (-1, "has no size"),
        ("9", "has no size"),
    ],
)
def test_sizes_that_no_file_may_have(desk: Desk, size: object, reason: str) -> None:
    assert reason in desk.begin("x.ngc", size)
    assert not desk.asked


def test_only_the_page_with_the_controls_sends_files(desk: Desk) -> None:
    assert "page 2: nothing done" in desk.begin("x.ngc", 10, page=OTHER)
    desk.begin("x.ngc", 2 * PIECE)
    # Pieces of other pages and of other files do nothing.
    desk.send(0, bytes(PIECE), page=OTHER)
    desk.send(0, bytes(PIECE), key="other")
    assert "0 %" in desk.uploads.text
    desk.send(0, bytes(PIECE))
    assert "50 %" in desk.uploads.text
    desk.requests.controls.give(OPERATOR)
    assert "has the controls no more" in desk.send(1, bytes(PIECE))
    assert list(desk.folder.folder.iterdir()) == []


def test_a_file_that_gives_way_to_a_newer_one_is_told(desk: Desk) -> None:
    """It was dropped without a word."""
    desk.begin("a.ngc", 2 * PIECE, key="a")
    desk.send(0, bytes(PIECE), key="a")
    assert desk.begin("b.ngc", 3) == "not uploaded: a.ngc: b.ngc is sent in its place"
    desk.send(1, bytes(PIECE), key="a")
    desk.requests.refusal = ""
    desk.send_all(b"M2\n")
    assert desk.files == desk.folder.names() == ["b.ngc"]
    # Of one that was cancelled the page knows.
    desk.begin("c.ngc", 10)
    desk.uploads.cancel()
    assert desk.begin("d.ngc", 3) == ""
    # One that is refused disturbs none.
    assert "e.ngc is empty" in desk.begin("e.ngc", 0, key="e")
    desk.requests.refusal = ""
    desk.send_all(b"M2\n")
    assert desk.files == ["b.ngc", "d.ngc"]


@pytest.mark.parametrize(
    ("index", "content", "reason"),
    [
        (1, bytes(PIECE), "did not come whole"),
        (-1, bytes(PIECE), "did not come whole"),
        (0, "text", "did not come whole"),
        (0, b"", "its size has changed"),
        (0, bytes(PIECE + 1), "its size has changed"),
    ],
)
def test_pieces_that_do_not_fit(desk: Desk, index: int, content: object, reason: str) -> None:
    desk.begin("x.ngc", 2 * PIECE)
    assert reason in desk.send(index, content)
    assert list(desk.folder.folder.iterdir()) == []
    # What comes behind it is of no file.
    desk.send(0, bytes(PIECE))
    assert desk.folder.names() == []


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "cannot be written" in Desk(tmp_path / "file").begin("x.ngc", 10)


def test_the_list_of_a_full_folder(desk: Desk, tmp_path: Path) -> None:
    folder = desk.folder.folder
    folder.mkdir()
    (folder / "sub").mkdir()
    for number in range(500):
        file = folder / f"{number}.ngc"
        file.write_text("M2\n")
        os.utime(file, (number, number))
    (folder / ".9.part").write_text("")
    outside = tmp_path / "outside.ngc"
    outside.write_text("M2\n")
    (folder / "link.ngc").symlink_to(outside)
    os.utime(outside, (0, 0))
    # The newest first.
    assert desk.folder.names()[:2] == ["499.ngc", "498.ngc"]
    assert len(desk.folder.names()) == 501
    for name in ("link.ngc", "../outside.ngc", "sub", "nothing.ngc", "\0", ""):
        with pytest.raises(ProgramFileError):
            desk.folder.path(name)
    ProgramFolder(folder)
    assert not (folder / ".9.part").exists()


def test_a_file_is_renamed_and_removed_and_nothing_else_is(tmp_path: Path) -> None:
    folder = ProgramFolder(tmp_path / "programs")
    (tmp_path / "outside.ngc").write_text("M2\n")
    folder.folder.mkdir()
    for name in ("a.ngc", "b.ngc"):
        (folder.folder / name).write_text(name)
    for new, reason in (
        ("b.ngc", "already"),
        ("../c.ngc", "slash"),
        (".c", "dot"),
        ("", "no name"),
    ):
        with pytest.raises(ProgramFileError, match=f"not renamed.*{reason}"):
            folder.rename("a.ngc", new)
    for wrong in ("../outside.ngc", "c.ngc", ""):
        with pytest.raises(ProgramFileError):
            folder.rename(wrong, "d.ngc")
        with pytest.raises(ProgramFileError):
            folder.remove(wrong)
    folder.rename("a.ngc", "c.ngc")
    folder.remove("b.ngc")
    assert [each.name for each in folder.folder.iterdir()] == ["c.ngc"]
    assert folder.path("c.ngc").read_text() == "a.ngc"
    assert (tmp_path / "outside.ngc").exists()
