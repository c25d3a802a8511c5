"""The folder of programs: files that a page sends in pieces, kept until somebody removes them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from os import getpid, scandir
from pathlib import Path
from typing import BinaryIO

import viser
from viser import _messages as messages

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import OutsideFolderError, file_in
from tri_glide_kinematics.panel.machine import OperatorRequests

# Entry of the list of programs while none is chosen: no file is called so.
NO_FILE = "choose a program"

# Of one file: some 2,000,000 lines [bytes].
LARGEST = 100_000_000
LONGEST_NAME = 120  # bytes

# A piece is a message that a page may send, with room for its head [bytes]. So many pieces are on
# their way at once: Stop waits behind no more, however slow the network is.
PIECE = 48 * 1024
PIECES_AHEAD = 8


class ProgramFileError(KinematicsError):
    """A file is none of the folder of programs, or cannot become one."""


def checked_name(name: object) -> str:
    """Return the ``name`` that a page has sent, if a file of the folder may be called so.

    Raises:
        ProgramFileError: if it may not.
    """
    if not isinstance(name, str) or not name:
        raise ProgramFileError("not uploaded: the file has no name")
    shown = ascii(name[:LONGEST_NAME])
    if len(name.encode("utf-8", "replace")) > LONGEST_NAME:
        raise ProgramFileError(
            f"not uploaded: the name {shown}... has more than {LONGEST_NAME} bytes"
        )
    if not name.isprintable() or "/" in name or "\\" in name:
        raise ProgramFileError(
            f"not uploaded: the name {shown} has a slash or a character that cannot be printed"
        )
    if name.startswith("."):
        raise ProgramFileError(f"not uploaded: the name {shown} begins with a dot")
    if name == NO_FILE:
        raise ProgramFileError(f"not uploaded: no file can be called {shown}")
    return name


def checked_size(name: str, size: object) -> int:
    """Return the ``size`` of a file in bytes, if the folder may hold it.

    Raises:
        ProgramFileError: if it may not.
    """
    if not isinstance(size, int) or size < 0:
        raise ProgramFileError(f"not uploaded: {name} has no size")
    if size == 0:
        raise ProgramFileError(f"not uploaded: {name} is empty")
    if size > LARGEST:
        raise ProgramFileError(
            f"not uploaded: {name} has {size / 1e6:,.1f} MB, at most {LARGEST / 1e6:g} MB"
        )
    return size


class ProgramFolder:
    """The folder of programs, which is made with the first file.

    Attributes:
        folder: where it is.
    """

    def __init__(self, folder: Path) -> None:
        """Take a ``folder``; what an upload has left there that never ended is removed."""
        self.folder = folder
        self._part = folder / f".{getpid()}.part"
        with suppress(OSError):
            for part in folder.glob(".*.part"):
                part.unlink()

    def names(self) -> list[str]:
        """Return the names of all programs, the newest first."""
        found = []
        with suppress(OSError), scandir(self.folder) as entries:
            for entry in entries:
                with suppress(OSError):
                    if entry.is_file() and not entry.name.startswith("."):
                        found.append((-entry.stat().st_mtime, entry.name))
        return [name for _, name in sorted(found) if name.isprintable() and name != NO_FILE]

    def path(self, name: str) -> Path:
        """Return the path of a program.

        Raises:
            ProgramFileError: if there is none of this name.
        """
        try:
            path = file_in(self.folder, name)
        except OutsideFolderError as error:
            raise ProgramFileError(
                f"{name[:LONGEST_NAME]!r} is no file in the folder of programs"
            ) from error
        if not path.is_file():
            raise ProgramFileError(
                f"{name[:LONGEST_NAME]!r} is no longer in the folder of programs"
            )
        return path

    def begin(self) -> BinaryIO:
        """Return an empty file, which ``keep`` makes a program.

        Raises:
            ProgramFileError: if it cannot be written.
        """
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            return self._part.open("wb")
        except OSError as error:
            raise ProgramFileError(
                f"not uploaded: the folder of programs cannot be written: {error.strerror or error}"
            ) from error

    def keep(self, name: str) -> None:
        """Make what was written a program, in place of one of the same name.

        Raises:
            ProgramFileError: if this cannot be done.
        """
        try:
            self._part.replace(file_in(self.folder, name))
        except OSError as error:
            raise ProgramFileError(f"not uploaded: {name}: {error.strerror or error}") from error
        except OutsideFolderError as error:
            raise ProgramFileError(
                f"not uploaded: {name} is no file in the folder of programs"
            ) from error

    def drop(self) -> None:
        """Remove what was written."""
        with suppress(OSError):
            self._part.unlink()


@dataclass
class _Incoming:
    """A file on its way.

    Attributes:
        page: that sends it.
        key: by which the page calls it.
        name: of the file.
        size: of the whole file [bytes].
        stream: that what has come is written to.
        received: what has come [bytes].
        count: of pieces that have come.
    """

    page: int
    key: str
    name: str
    size: int
    stream: BinaryIO
    received: int = 0
    count: int = 0


class Uploads:
    """Takes the files that pages send, one at a time, where the pages are heard.

    The page sends no more pieces than it is asked for. Pieces that nobody has asked for are
    dropped, as is the file of a page that gives up the controls.

    Attributes:
        folder: that they come into.
        on_file: gets the name of a whole file, where the node spins.
    """

    def __init__(
        self,
        folder: ProgramFolder,
        requests: OperatorRequests,
        ask: Callable[[int, str, int], None],
    ) -> None:
        """Write into a ``folder``; ``ask`` asks a page for pieces of a file, by its key."""
        self.folder = folder
        self.on_file: Callable[[str], None] = lambda _: None
        self._requests = requests
        self._ask = ask
        self._incoming: _Incoming | None = None

    @property
    def text(self) -> str:
        """What is on its way, in words; empty for nothing."""
        incoming = self._incoming
        if incoming is None:
            return ""
        part = 100.0 * incoming.received / incoming.size
        return f"{incoming.name}: {part:.0f} % of {incoming.size / 1e6:.1f} MB are here"

    def take(self, page: int, message: messages.Message) -> None:
        """Take what a ``page`` says of a file."""
        try:
            if isinstance(message, messages.FileTransferStartUpload):
                self._begin(page, message)
            elif isinstance(message, messages.FileTransferPart):
                self._add(page, message)
        except OSError as error:
            self._give_up(f"the disk: {error.strerror or error}")
        except KinematicsError as error:
            self._requests.refuse(str(error))

    async def closed(self, client: viser.ClientHandle) -> None:
        """Drop the file of a page that has vanished."""
        if self._incoming is not None and self._incoming.page == client.client_id:
            self._drop()

    def _begin(self, page: int, message: messages.FileTransferStartUpload) -> None:
        if not self._requests.may(page):
            return
        name = checked_name(message.filename)
        size = checked_size(name, message.size_bytes)
        self._drop()
        key = str(message.transfer_uuid)[:64]
        self._incoming = _Incoming(page, key, name, size, self.folder.begin())
        self._ask(page, key, PIECES_AHEAD)

    def _add(self, page: int, message: messages.FileTransferPart) -> None:
        incoming = self._incoming
        if incoming is None or (page, str(message.transfer_uuid)) != (incoming.page, incoming.key):
            return
        content = message.content
        if self._requests.controls.holder != page:
            self._give_up("its page has the controls no more")
        elif message.part_index != incoming.count or not isinstance(content, bytes):
            self._give_up("it did not come whole")
        elif len(content) != min(PIECE, incoming.size - incoming.received):
            self._give_up("its size has changed on the way")
        else:
            incoming.stream.write(content)
            incoming.received += len(content)
            incoming.count += 1
            if incoming.received == incoming.size:
                self._finish(incoming)
            else:
                self._ask(page, incoming.key, incoming.count + PIECES_AHEAD)

    def _finish(self, incoming: _Incoming) -> None:
        self._incoming = None
        incoming.stream.close()
        self.folder.keep(incoming.name)
        self._requests.wish(lambda: self.on_file(incoming.name))

    def _give_up(self, reason: str) -> None:
        name = self._incoming.name if self._incoming is not None else "the file"
        self._drop()
        self._requests.refuse(f"not uploaded: {name}: {reason}")

    def _drop(self) -> None:
        if self._incoming is not None:
            incoming, self._incoming = self._incoming, None
            with suppress(OSError):
                incoming.stream.close()
            self.folder.drop()
