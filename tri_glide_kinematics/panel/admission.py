"""Admission: who is let in to the page, and viser's server, which answers only those."""

from __future__ import annotations

import asyncio
import logging
import os
import re
import secrets
import stat
import warnings
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from hmac import compare_digest
from io import StringIO
from ipaddress import ip_address
from pathlib import Path
from threading import Lock
from typing import Any
from urllib.parse import parse_qs

import viser
from websockets.asyncio import server as websockets_server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import NoHomeError, state_folder
from tri_glide_kinematics.panel.viser_parts import messages
from tri_glide_kinematics.reason_log import ReasonLog

# Admission: a request needs the token, an address of ours, and no origin but our page.
#
# A browser lets any page of the world connect to this computer. It tells the server which page that
# is (the origin) and by which name it found the server (the host). The owner of a name can make it
# lead here (DNS rebinding), so the host has to be an address. Programs may tell any origin and
# host, so the token decides. It comes in the address; the answer has the browser keep it as a
# cookie.

QUERY = "token"
# The cookie lasts for so long after the page was last opened [s].
COOKIE_AGE = 365 * 24 * 3600
HOST = re.compile(r"(?P<name>\[[0-9A-Fa-f:.]+\]|[^\s:/?#@\[\]]+)(?::(?P<port>[0-9]{1,5}))?")
# Longest part of a foreign text that is told to others [characters].
SHOWN = 80


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


# viser's server, which answers only those who are let in, and hears only what a page may say.
#
# viser cannot refuse a connection. It serves by ``websockets``, which can: a request that is
# refused in the handshake gets its answer (403), and nothing else of its connection is read. So
# viser finds, while it starts, another ``serve``, which asks the admission first. If viser does not
# use it, there is no server.

FORBIDDEN, OK = 403, 200  # status codes of HTTP
WRONG_VERSION = 1002  # "protocol error" of RFC 6455
# A page says little: where its camera is, what is pressed, a text in a field [bytes].
LONGEST_MESSAGE = 64 * 1024
LINES_PER_SECOND = 1  # of the log: whoever knocks again and again does not fill it
# A file that a page sends: not for viser, which would keep whatever comes in its memory.
OF_FILES = (messages.FileTransferPart, messages.FileTransferStartUpload)
# Kinds of messages that our pages send; viser reads others, too.
SAID_BY_PAGES = (
    *OF_FILES,
    messages.GuiButtonHoldMessage,
    messages.GuiUpdateMessage,
    messages.TransformControlsDragEndMessage,
    messages.TransformControlsDragStartMessage,
    messages.TransformControlsUpdateMessage,
    messages.ViewerCameraMessage,
)
SHARING = (messages.ShareUrlDisconnect, messages.ShareUrlRequest)
# Replaces the address with the token by one without: by a page, as a browser that follows a link of
# another page gives no cookie to the page to which it is only redirected.
ENTRANCE = """<!doctype html>
<meta charset="utf-8">
<title>tri-glide</title>
<meta name="viewport" content="width=device-width">
<meta http-equiv="refresh" content="0; url=./">
<p><a href="./">The panel</a></p>
"""

Tell = Callable[[str], object]
TakeFile = Callable[[ServerConnection, messages.Message], object]
Answer = Callable[[ServerConnection, HttpRequest], Response | None]
# viser is started with another ``serve`` in its sight: one at a time.
_starting = Lock()


class UnguardedPageError(KinematicsError):
    """The page would be open to everybody, as viser does not serve it the way it did."""

    def __init__(self, version: str) -> None:
        """Keep the ``version`` of viser."""
        self.version = version
        super().__init__(
            f"viser {version} does not let this panel refuse connections: install viser==1.1.1"
        )


class PageConnection(ServerConnection):
    """A connection that passes on what a page may say, and drops everything else."""

    tell: Tell
    take_file: TakeFile

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message that a page may send to viser."""
        while True:
            data = await super().recv(decode)
            message = message_of(data)
            if isinstance(message, str):
                self.tell(f"dropped a message of a page: {message}")
            elif isinstance(message, OF_FILES):
                self.take_file(self, message)
            else:
                return data


def message_of(data: str | bytes) -> messages.Message | str:
    """Return the message that a page may send, or why it is none."""
    if isinstance(data, str):
        return "it is a text"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            message = messages.Message.deserialize(data)
    except Exception as error:
        return f"it cannot be read ({type(error).__name__})"
    if isinstance(message, SHARING):
        return "refused to share the page: it is for this network only"
    if not isinstance(message, SAID_BY_PAGES):
        return f"it is a {type(message).__name__}"
    # viser would set anything.
    if isinstance(message, messages.GuiUpdateMessage) and set(message.updates) != {"value"}:
        return "it changes more than the value of a field"
    return message


def guarded_server(
    host: str, port: int, admission: Admission, write: Tell, take_file: TakeFile
) -> viser.ViserServer:
    """Start viser's server behind an ``admission``; port 0 is any.

    ``write`` gets one line a second, at most two, on what was refused and what went wrong.
    ``take_file`` gets what a page says of a file that it sends.

    Raises:
        UnguardedPageError: if viser cannot be started in this way.
    """
    guard = _Guard(admission, write, take_file)
    # viser prints a frame with addresses, of which none is for people.
    with _starting, _serving_by(guard), redirect_stdout(StringIO()):
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if not guard.is_in_place:
        server.stop()
        raise UnguardedPageError(viser.__version__)
    return server


@contextmanager
def _serving_by(guard: _Guard) -> Iterator[None]:
    given = websockets_server.serve
    websockets_server.serve = guard.serving(given)  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        websockets_server.serve = given  # type: ignore[misc]


class _Guard:
    """The guard between the network and viser.

    Attributes:
        is_in_place: whether viser serves by it.
    """

    def __init__(self, admission: Admission, write: Tell, take_file: TakeFile) -> None:
        self._admission = admission
        self._take_file = take_file
        self._log = ReasonLog(write, LINES_PER_SECOND)
        self.is_in_place = False

    def serving(self, given: Callable[..., Any]) -> Callable[..., Any]:
        """Return a ``serve`` that asks this guard first, and takes all else as it was ``given``."""

        def serve(
            handler: Callable[[ServerConnection], Awaitable[None]],
            *place: Any,
            process_request: Answer | None = None,
            **options: Any,
        ) -> Any:
            loop = asyncio.get_running_loop()
            loop.set_exception_handler(self._on_error)
            if not self.is_in_place:
                self._every_second(loop)
            self.is_in_place = True
            return given(
                self._heard_by(handler),
                *place,
                **{
                    **options,
                    "process_request": self._asked_before(process_request),
                    "create_connection": self._connection,
                    "logger": self._logger(),
                    "max_size": LONGEST_MESSAGE,
                },
            )

        return serve

    def tell(self, reason: str) -> None:
        """Log a ``reason``, unless there were too many; called where viser's server runs."""
        self._log.add(reason)

    def _asked_before(self, answer: Answer | None) -> Answer:
        """Return what answers requests: by ``answer`` if they are let in."""

        def process_request(connection: ServerConnection, http: HttpRequest) -> Response | None:
            request = Request.of(http.path, http.headers)
            refusal = self._admission.refusal(request)
            if refusal is not None:
                self.tell(f"refused a connection: {refusal.reason}")
                response = connection.respond(FORBIDDEN, f"{refusal.advice}\n")
                _add(response, {"Cache-Control": "no-store", "Referrer-Policy": "no-referrer"})
                return response
            if "Upgrade" not in http.headers and self._admission.knows_token(request.query_tokens):
                response = connection.respond(OK, ENTRANCE)
                del response.headers["Content-Type"]
                _add(response, {"Content-Type": "text/html", "Cache-Control": "no-store"})
            else:
                given = answer(connection, http) if answer is not None else None
                if given is None:
                    return None
                response = given
            _add(response, _of_pages(request))
            _add(response, {"Set-Cookie": self._admission.set_cookie(request)})
            return response

        return process_request

    def _heard_by(
        self, handler: Callable[[ServerConnection], Awaitable[None]]
    ) -> Callable[[ServerConnection], Awaitable[None]]:
        """Return what hears a connection: the ``handler``, if the page is of the same viser."""

        async def handle(connection: ServerConnection) -> None:
            version = (connection.subprotocol or "").removeprefix("viser-v") or "unknown"
            if version != viser.__version__:
                # As viser does it, which prints what came in.
                self.tell(f"closed the page of another viser ({shown([version])}): reload it")
                text = f"Version mismatch. Client: {version}, Server: {viser.__version__}"
                await connection.close(WRONG_VERSION, text[:120])
                return
            try:
                await handler(connection)
            except Exception as error:
                self.tell(f"lost a page: {_in_a_line(error)}")

        return handle

    def _connection(self, *arguments: Any, **options: Any) -> PageConnection:
        connection = PageConnection(*arguments, **options)
        connection.tell = self.tell
        connection.take_file = self._take_file
        return connection

    def _on_error(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        what = _in_a_line(error) if error is not None else shown([context.get("message", "")])
        self.tell(f"a message of a page failed: {what}")

    def _logger(self) -> logging.Logger:
        """Return a log of websockets that leads to ours, in lines without tracebacks."""
        logger = logging.Logger("panel", logging.ERROR)
        handler = logging.Handler()
        handler.emit = lambda record: self.tell(_line_of(record))  # type: ignore[method-assign]
        logger.addHandler(handler)
        return logger

    def _every_second(self, loop: asyncio.AbstractEventLoop) -> None:
        self._log.end_of_second()
        loop.call_later(1.0, self._every_second, loop)


def _of_pages(request: Request) -> dict[str, str]:
    """Return headers of what is served: it connects to us only, and no other page holds it."""
    here = request.hosts[0]
    return {
        "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff",
        "X-Frame-Options": "DENY",
        "Content-Security-Policy": f"connect-src ws://{here} wss://{here} http://{here} "
        f"https://{here} data: blob:; frame-ancestors 'none'; form-action 'none'",
    }


def _add(response: Response, headers: dict[str, str]) -> None:
    for name, value in headers.items():
        response.headers[name] = value


def _line_of(record: logging.LogRecord) -> str:
    error = record.exc_info[1] if record.exc_info else None
    return record.getMessage() + (f": {_in_a_line(error)}" if error is not None else "")


def _in_a_line(error: BaseException) -> str:
    """Return an ``error`` and where it was raised, without what somebody sent."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = f" in {trace.tb_frame.f_code.co_name}" if trace is not None else ""
    return f"{type(error).__name__}{place}"
