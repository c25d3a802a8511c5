"""What is there already is kept, or left alone."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.files import replace_file


def test_an_older_file_is_kept_and_nothing_else_is_left(tmp_path):
    file = tmp_path / "file.yaml"
    replace_file(file, "# Ours.\na: 1\n")
    replace_file(file, "# Ours.\na: 2\n")
    assert file.read_text() == "# Ours.\na: 2\n"
    assert (tmp_path / "file.yaml.bak").read_text() == "# Ours.\na: 1\n"
    assert len(list(tmp_path.iterdir())) == 2


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
    with pytest.raises(FileNotFoundError):
        replace_file(tmp_path / "no" / "file", "# Ours.\n")
