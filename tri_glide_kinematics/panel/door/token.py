"""The token in the address of the page: kept in a file that only its user can read."""

from __future__ import annotations

import os
import re
import secrets
import stat
from contextlib import suppress
from pathlib import Path

from tri_glide_kinematics.panel.errors import TokenFileError

# 256 random bits, as text that needs no quoting in an address or a cookie.
RANDOM_BYTES = 32
# Somebody may write a token by hand, but none that can be guessed.
TOKEN = re.compile(r"[A-Za-z0-9_-]{16,256}")


def default_token_file() -> Path:
    """Return where the token of this user is kept, by the XDG Base Directory Specification.

    Raises:
        TokenFileError: if the user has no home.
    """
    state = Path(os.environ.get("XDG_STATE_HOME", ""))
    # By the specification, a relative path has no meaning.
    if not state.is_absolute():
        try:
            state = Path.home() / ".local" / "state"
        except RuntimeError as error:
            raise TokenFileError(Path("~"), str(error)) from error
    return state / "tri_glide_kinematics" / "panel_token"


def kept_token(file: Path) -> str:
    """Return the token in a ``file``, which is made if there is none.

    Raises:
        TokenFileError: if it cannot be made or read, is open to others, or holds no token.
    """
    try:
        if not file.exists():
            _make(file)
        return _read(file)
    except OSError as error:
        raise TokenFileError(file, error.strerror or str(error)) from error


def _make(file: Path) -> None:
    """Put a new token into a ``file``, unless somebody else does so at the same moment."""
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    part = file.with_name(f"{file.name}.{os.getpid()}.{secrets.token_hex(4)}")
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with os.fdopen(descriptor, "w", encoding="ascii") as stream:
            stream.write(secrets.token_urlsafe(RANDOM_BYTES) + "\n")
            stream.flush()
            os.fsync(stream.fileno())
        # A link is never half there, and replaces nothing.
        with suppress(FileExistsError):
            os.link(part, file)
    finally:
        part.unlink()


def _read(file: Path) -> str:
    with file.open(encoding="ascii", errors="replace") as stream:
        about = os.fstat(stream.fileno())
        if not stat.S_ISREG(about.st_mode):
            raise TokenFileError(file, "it is no file")
        if about.st_uid != os.getuid():
            raise TokenFileError(file, f"it belongs to user {about.st_uid}, not to {os.getuid()}")
        if about.st_mode & 0o077:
            mode = stat.S_IMODE(about.st_mode)
            raise TokenFileError(file, f"others may read it (mode {mode:04o}; needed: 0600)")
        token = stream.read(1024).strip()
    if not TOKEN.fullmatch(token):
        raise TokenFileError(file, "it holds no token: 16 to 256 letters, digits, - and _")
    return token
