"""Writes files so that nobody's work is lost: a foreign file is refused, an old one is kept."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

BACKUP = ".bak"


def replace_file(file: str | Path, text: str) -> None:
    """Write a file, all of it or nothing; what was there before becomes ``NAME.bak``.

    Args:
        file: where. A file that is there must begin with the same line as the text.
        text: its first line tells what wrote it.

    Raises:
        OSError: if it cannot be written, or another wrote what is there.
    """
    file = Path(file).resolve()
    if file.exists():
        _check_same_kind(file, text.split("\n", 1)[0])
        shutil.copy2(file, file.with_name(file.name + BACKUP))
    new = file.with_name(f"{file.name}.{os.getpid()}.new")
    try:
        new.write_text(text, encoding="utf-8")
        new.replace(file)
    finally:
        new.unlink(missing_ok=True)


def _check_same_kind(file: Path, first: str) -> None:
    if not file.is_file():
        raise OSError(errno.EINVAL, "it is there, and no regular file")
    wanted = first.encode()
    with file.open("rb") as stream:
        if stream.read(len(wanted)) != wanted:
            raise FileExistsError(
                errno.EEXIST, f"it is there, and its first line is not {first!r}: choose another"
            )
