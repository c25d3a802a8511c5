"""The file that keeps the token."""

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tri_glide_kinematics.panel.admission import (
    TOKEN,
    TokenFileError,
    default_token_file,
    kept_token,
)


def test_it_is_made_once_for_its_user_alone(tmp_path: Path) -> None:
    file = tmp_path / "a" / "b" / "token"
    token = kept_token(file)
    assert len(token) == 43
    assert TOKEN.fullmatch(token)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert kept_token(file) == token
    assert kept_token(tmp_path / "other") != token
    assert [each.name for each in file.parent.iterdir()] == ["token"]


def test_all_who_start_at_once_have_the_same(tmp_path: Path) -> None:
    with ThreadPoolExecutor(16) as threads:
        for number in range(20):
            file = tmp_path / str(number)
            assert len(set(threads.map(kept_token, [file] * 16))) == 1


def test_one_of_others_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "token"
    kept_token(file)
    file.chmod(0o640)
    with pytest.raises(TokenFileError, match=r"others may read it \(mode 0640; needed: 0600\)"):
        kept_token(file)


@pytest.mark.parametrize("text", ["", "short", "with space in it, long enough", "\xff" * 40])
def test_one_that_could_be_guessed_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "token"
    file.touch(mode=0o600)
    file.write_text(text, encoding="latin-1")
    with pytest.raises(TokenFileError, match="it holds no token"):
        kept_token(file)
    assert file.read_text(encoding="latin-1") == text


def test_a_place_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(TokenFileError, match="choose another file with -p token_file"):
        kept_token(tmp_path / "file" / "token")
    with pytest.raises(TokenFileError, match="directory"):
        kept_token(tmp_path)


def test_where_it_is_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    home = tmp_path / ".local" / "state" / "tri_glide_kinematics" / "panel_token"
    assert default_token_file() == home
    monkeypatch.setenv("XDG_STATE_HOME", "relative")
    assert default_token_file() == home
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    file = default_token_file()
    assert file == tmp_path / "state" / "tri_glide_kinematics" / "panel_token"
    assert os.path.isabs(file)
