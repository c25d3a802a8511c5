"""What is there already is kept, or left alone; what is written is whole."""

import os

import pytest
from full_disk import full_disk

from tri_glide_kinematics.files import OutsideFolderError, file_in, replace_file, write_file


def texts_in(folder):
    """Return all files of a folder with what they hold."""
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_an_older_file_is_kept_and_nothing_else_is_left(tmp_path):
    file = tmp_path / "file.yaml"
    for number in (1, 2, 3, 3):
        replace_file(file, f"# Ours.\na: {number}\n")
    assert texts_in(tmp_path) == {
        "file.yaml": "# Ours.\na: 3\n",
        "file.yaml.bak": "# Ours.\na: 1\n",
        "file.yaml.bak2": "# Ours.\na: 2\n",
    }


def test_a_full_disk_loses_nothing(tmp_path):
    file = tmp_path / "file.yaml"
    replace_file(file, "# Ours.\na: 1\n")
    replace_file(file, "# Ours.\na: 2\n")
    before = texts_in(tmp_path)
    long_text = "# Ours.\n" + 10_000 * "b: 1\n"
    for room in (0, 3, 5_000, len(long_text) - 1):
        for write in (replace_file, write_file):
            with full_disk(room), pytest.raises(OSError, match="File too large"):
                write(file, long_text)
            assert texts_in(tmp_path) == before
    with full_disk(len(long_text)):
        replace_file(file, long_text)
    assert texts_in(tmp_path) == {
        **before,
        "file.yaml": long_text,
        "file.yaml.bak2": before[file.name],
    }


@pytest.mark.parametrize("text", ["# Of somebody.\na: 1\n", "", "a: 1\n"])
def test_a_file_of_another_is_left_alone(tmp_path, text):
    file = tmp_path / "file.yaml"
    file.write_text(text)
    with pytest.raises(FileExistsError, match=r"its first line is not '# Ours\.'"):
        replace_file(file, "# Ours.\na: 2\n")
    assert file.read_text() == text
    assert list(tmp_path.iterdir()) == [file]


def test_what_is_no_file_is_told(tmp_path):
    with pytest.raises(OSError, match="no regular file"):
        replace_file(tmp_path, "# Ours.\n")
    for write in (replace_file, write_file):
        with pytest.raises(FileNotFoundError, match=r"no/file'$"):
            write(tmp_path / "no" / "file", "# Ours.\n")


def test_files_in_a_folder(tmp_path):
    folder = tmp_path / "ours"
    (folder / "below").mkdir(parents=True)
    (tmp_path / "theirs").mkdir()
    (folder / "way_out").symlink_to(tmp_path / "theirs")
    (folder / "circle").symlink_to(folder / "circle")
    for name in ("a.yaml", "below/a.yaml", str(folder / "a.yaml"), "below/../a.yaml"):
        assert folder in file_in(folder, name).parents
    outside = ("", ".", "..", "../x", "../../x", "below/../../x", str(tmp_path / "x"), "/etc/x")
    for name in (*outside, "way_out/x", "a\0b", "../ours"):
        with pytest.raises(OutsideFolderError, match="is no file in the folder") as caught:
            file_in(folder, name)
        assert (caught.value.file, caught.value.folder) == (name, folder)
    # What cannot be a file gets an error of the package, or of the system when it is written.
    for name in ("circle/x", 300 * "a"):
        with pytest.raises((OutsideFolderError, OSError)):
            write_file(file_in(folder, name), "")


@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_what_is_no_regular_file_is_never_replaced(tmp_path, kind):
    file = tmp_path / "there"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "device":
        file.symlink_to(os.devnull)
    else:
        file.mkdir()
    before = file.stat()
    with pytest.raises(OSError, match="no regular file"):
        write_file(file, "text")
    assert (file.stat().st_mode, file.stat().st_ino) == (before.st_mode, before.st_ino)
