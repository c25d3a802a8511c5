"""Admission: a request needs the token, an address of ours, and no origin but our page.

A browser lets any page of the world connect to this computer. It tells the server which page that
is (the origin) and by which name it found the server (the host). The owner of a name can make it
lead here (DNS rebinding), so the host has to be an address. Programs may tell any origin and host,
so the token decides. It comes in the address; the answer has the browser keep it as a cookie.
"""

from __future__ import annotations

import os
import re
import secrets
import stat
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from hmac import compare_digest
from ipaddress import ip_address
from pathlib import Path
from typing import Protocol
from urllib.parse import parse_qs

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import NoHomeError, state_folder

QUERY = "token"
# The cookie lasts for so long after the page was last opened [s].
COOKIE_AGE = 365 * 24 * 3600
HOST = re.compile(r"(?P<name>\[[0-9A-Fa-f:.]+\]|[^\s:/?#@\[\]]+)(?::(?P<port>[0-9]{1,5}))?")
# Longest part of a foreign text that is told to others [characters].
SHOWN = 80


class Headers(Protocol):
    """Headers of a request, as websockets has them."""

    def get_all(self, key: str) -> Sequence[str]:
        """Return all values of a header."""


@dataclass(frozen=True)
class Request:
    """The request of a browser, before anything else is read.

    Attributes:
        path: with the query.
        hosts, origins, cookies: all headers of these names.
    """

    path: str
    hosts: Sequence[str]
    origins: Sequence[str] = ()
    cookies: Sequence[str] = ()

    @classmethod
    def of(cls, path: str, headers: Headers) -> Request:
        """Read the ``headers`` that count."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        return cls(path, hosts, origins, headers.get_all("Cookie"))

    @property
    def cookie_name(self) -> str:
        """Name of the cookie: a browser gives all ports of a host the same ones."""
        found = HOST.fullmatch(self.hosts[0]) if self.hosts else None
        return f"tri_glide_panel_{found['port'] or '80'}" if found else ""

    @property
    def query_tokens(self) -> Sequence[str]:
        """Tokens in the address."""
        return parse_qs(self.path.partition("?")[2], max_num_fields=None).get(QUERY, ())

    @property
    def cookie_tokens(self) -> Iterator[str]:
        """Tokens that the browser has kept."""
        for cookie in ";".join(self.cookies).split(";"):
            name, _, value = cookie.strip().partition("=")
            if name == self.cookie_name:
                yield value


@dataclass(frozen=True)
class Refusal:
    """Why a request is refused.

    Attributes:
        reason: for the log.
        advice: for the person who sees it in place of the page.
    """

    reason: str
    advice: str


@dataclass(frozen=True)
class Admission:
    """The conditions for admission to the page of a ``host``, by name or address."""

    host: str
    token: str

    def refusal(self, request: Request) -> Refusal | None:
        """Return why a ``request`` is refused, None if it is let in."""
        if len(request.hosts) != 1 or not self._is_here(request.hosts[0]):
            hosts = shown(request.hosts)
            return Refusal(
                f"it came by the name {hosts}, which is no address of this computer",
                "This page is served by its address only: open it with the number of the computer "
                "(http://192.168.0.7:8080/?token=..., for instance) in place of a name.",
            )
        if not self._is_own_page(request):
            return Refusal(
                f"it came from the page {shown(request.origins)}, which is not ours",
                "This connection comes from another page: only the panel's own page may connect.",
            )
        if self.knows_token(request.query_tokens) or self.knows_token(request.cookie_tokens):
            return None
        return Refusal(
            "it had no token or a wrong one",
            "This page asks for its token: open the address with ?token=... that panel_node prints "
            "when it starts, in a browser that may keep a cookie.",
        )

    def knows_token(self, tokens: Sequence[str] | Iterator[str]) -> bool:
        """Tell whether one of these is the token, compared in constant time."""
        own = self.token.encode()
        return any([compare_digest(own, each.encode("utf-8", "surrogatepass")) for each in tokens])

    def set_cookie(self, request: Request) -> str:
        """Return the header with which a browser keeps the token, out of the reach of scripts."""
        return (
            f"{request.cookie_name}={self.token}; Path=/; Max-Age={COOKIE_AGE}; HttpOnly; "
            "SameSite=Strict"
        )

    def _is_here(self, host: str) -> bool:
        found = HOST.fullmatch(host)
        if found is None or int(found["port"] or 80) > 65535:
            return False
        name = found["name"].lower()
        return name in ("localhost", self.host.lower()) or is_address(name.strip("[]"))

    def _is_own_page(self, request: Request) -> bool:
        # A program is no page, and says so by saying nothing.
        if not request.origins:
            return True
        host = request.hosts[0].lower()
        return [each.lower() for each in request.origins] in (
            [f"http://{host}"],
            [f"https://{host}"],
        )


def shown(values: Sequence[str]) -> str:
    """Return what somebody sent, fit for a log: short, and without control characters."""
    if not values:
        return "(none)"
    # A character may take six of ASCII.
    text = ascii(", ".join(values)[:SHOWN])
    return text if len(text) <= SHOWN + 2 else f"{text[:SHOWN]}..."


def is_address(name: str) -> bool:
    """Tell whether a ``name`` is an address in numbers."""
    try:
        ip_address(name)
    except ValueError:
        return False
    return True


def is_loopback(host: str) -> bool:
    """Tell whether only this computer can reach a ``host``."""
    return host == "localhost" or (is_address(host) and ip_address(host).is_loopback)


# 256 random bits, as text that needs no quoting in an address or a cookie.
RANDOM_BYTES = 32
# Somebody may write a token by hand, but none that can be guessed.
TOKEN = re.compile(r"[A-Za-z0-9_-]{16,256}")


class TokenFileError(KinematicsError):
    """The token in the address of the page cannot be kept."""

    def __init__(self, file: Path, reason: str) -> None:
        """Keep the ``file`` and why it is of no use."""
        self.file, self.reason = file, reason
        super().__init__(
            f"the token of the page cannot be kept in {file}: {reason}; "
            "mend this, or choose another file with -p token_file:=..."
        )


def default_token_file() -> Path:
    """Return where the token of this user is kept, by the XDG Base Directory Specification.

    Raises:
        TokenFileError: if the user has no home.
    """
    try:
        return state_folder() / "panel_token"
    except NoHomeError as error:
        raise TokenFileError(Path("~"), str(error)) from error


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
