"""The programs of the page: their folder, and the one that is chosen."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from os import getpid, scandir
from pathlib import Path
from time import monotonic
from typing import BinaryIO

import numpy as np
import viser

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import OutsideFolderError, file_in
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.program_reading import (
    Answer,
    Mark,
    NotRead,
    Reading,
    ReadingProcess,
    ReadProgram,
    mark_of,
    points_of_line,
    shown_text,
)
from tri_glide_kinematics.panel.viser_parts import messages
from tri_glide_kinematics.panel.words import clock_text, note, progress, table
from tri_glide_kinematics.programs import (
    Dialect,
    ProgramCheck,
    ProgramRun,
    ProgramSettings,
    RunState,
    Scales,
    TimeLeft,
    load_own_settings,
    with_kept_zeros,
)
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

# The folder of programs: files that a page sends in pieces, kept until somebody removes them.

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


def checked_name(name: object, nothing: str = "not uploaded") -> str:
    """Return the ``name`` that a page has sent, if a file of the folder may be called so.

    Otherwise the error says that ``nothing`` was done.

    Raises:
        ProgramFileError: if it may not.
    """
    if not isinstance(name, str) or not name:
        raise ProgramFileError(f"{nothing}: the file has no name")
    shown = ascii(name[:LONGEST_NAME])
    if len(name.encode("utf-8", "replace")) > LONGEST_NAME:
        raise ProgramFileError(f"{nothing}: the name {shown}... has more than {LONGEST_NAME} bytes")
    if not name.isprintable() or "/" in name or "\\" in name:
        raise ProgramFileError(
            f"{nothing}: the name {shown} has a slash or a character that cannot be printed"
        )
    if name.startswith("."):
        raise ProgramFileError(f"{nothing}: the name {shown} begins with a dot")
    if name == NO_FILE:
        raise ProgramFileError(f"{nothing}: no file can be called {shown}")
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


@contextmanager
def _refusing(nothing: str) -> Iterator[None]:
    """Say that ``nothing`` was done where the system refuses something."""
    try:
        yield
    except OSError as error:
        raise ProgramFileError(f"{nothing}: {error.strerror or error}") from error


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
        path = self._place(name)
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
        with _refusing("not uploaded: the folder of programs cannot be written"):
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            return self._part.open("wb")

    def keep(self, name: str) -> None:
        """Make what was written a program, in place of one of the same name.

        Raises:
            ProgramFileError: if this cannot be done.
        """
        with _refusing(f"not uploaded: {name}"):
            self._part.replace(self._place(name))

    def remove(self, name: str) -> None:
        """Remove a program.

        Raises:
            ProgramFileError: if there is none of this name, or it cannot be removed.
        """
        with _refusing(f"not removed: {name}"):
            self.path(name).unlink()

    def rename(self, name: str, new: str) -> None:
        """Give a program a ``new`` name.

        Raises:
            ProgramFileError: if it cannot be called so, or another one is.
        """
        target = self.folder / checked_name(new, "not renamed")
        with _refusing(f"not renamed: {name}"):
            # Unlike a rename, a link replaces nothing.
            path = self.path(name)
            try:
                target.hardlink_to(path)
            except FileExistsError as error:
                raise ProgramFileError(f"not renamed: there is a file {new} already") from error
            path.unlink()

    def _place(self, name: str) -> Path:
        try:
            return file_in(self.folder, name)
        except OutsideFolderError as error:
            raise ProgramFileError(
                f"{name[:LONGEST_NAME]!r} is no file in the folder of programs"
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
        is_cancelled: whether the rest is not wanted.
    """

    page: int
    key: str
    name: str
    size: int
    stream: BinaryIO
    received: int = 0
    count: int = 0
    is_cancelled: bool = False


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
        """What is on its way, for the page; empty for nothing."""
        incoming = self._incoming
        if incoming is None or incoming.is_cancelled:
            return ""
        words = f"{incoming.name}, {incoming.size / 1e6:.1f} MB, is being sent (cancel ends it)"
        return progress(incoming.received / incoming.size, words, is_work=True)

    def cancel(self) -> str:
        """Take no more of what is on its way, and return its name; empty for nothing."""
        incoming = self._incoming
        if incoming is None or incoming.is_cancelled:
            return ""
        incoming.is_cancelled = True
        return incoming.name

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
        if self._incoming is not None and not self._incoming.is_cancelled:
            # As of other requests, the newest one counts.
            self._give_up(f"{name} is sent in its place")
        self._drop()
        key = str(message.transfer_uuid)[:64]
        self._incoming = _Incoming(page, key, name, size, self.folder.begin())
        self._ask(page, key, PIECES_AHEAD)

    def _add(self, page: int, message: messages.FileTransferPart) -> None:
        incoming = self._incoming
        if incoming is None or (page, str(message.transfer_uuid)) != (incoming.page, incoming.key):
            return
        content = message.content
        if incoming.is_cancelled:
            self._drop()
        elif self._requests.controls.holder != page:
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


# Larger files are not sent to a page: what it is told meanwhile would wait behind them [bytes].
LARGEST_SENT = 5_000_000


def send_file(requests: OperatorRequests, path: Path) -> None:
    """Send a file to the page that has the controls.

    Raises:
        ProgramFileError: if it cannot be read, or is too large.
    """
    holder = requests.controls.holder
    client = None if holder is None else requests.server.get_clients().get(holder)
    with _refusing(f"not sent: {path.name}"):
        if (size := path.stat().st_size) > LARGEST_SENT:
            text = f"{size / 1e6:,.1f} MB, at most {LARGEST_SENT / 1e6:g} MB: copy {path}"
            raise ProgramFileError(f"not sent: {path.name} has {text}")
        if client is not None:
            client.send_file_download(path.name, path.read_bytes(), PIECE, save_immediately=True)


# The program that is chosen on the page, and what is known of it before and while it runs.

FROM_SETTINGS = "as in the settings"
LONGEST_LINE = 80  # characters of it that are shown
MOST_TOLD = 5  # words that a program has and the machine does not do


class ChosenProgram:
    """A file of the folder: it is read, and proved where that is asked for.

    Attributes:
        files: the settings of programs, and the work zeros that are kept.
        name: of the file; empty for none.
        dialect: in which it is read.
        read: what it means; None before that is known.
        check: the proof of it; None before that is there, or when it holds no more.
        error: why it is not read, or not proved.
        run: the newest one of it; None before the first.
    """

    def __init__(
        self, folder: ProgramFolder, settings_file: Path, zeros_file: Path, machine: ShownMachine
    ) -> None:
        """Choose none yet.

        Args:
            folder: of the programs.
            settings_file: what programs do not say.
            zeros_file: the work zeros that are kept.
            machine: whose place is where a program begins that says no other.
        """
        self.files = settings_file, zeros_file
        self.name = ""
        self.dialect = FROM_SETTINGS
        self.read: ReadProgram | None = None
        self.check: ProgramCheck | None = None
        self.error = ""
        self.run: ProgramRun | None = None
        self._folder = folder
        self._shown_machine = machine
        self._facts: MachineFacts | None = None
        # Whether the machine has other bounds than when it was proved.
        self._is_outdated = False
        # Of what was read last: the machine, the marks of its files, and what it does not say.
        self._read_for: MachineFacts | None = None
        self._marks: tuple[Mark, ...] = ()
        self._settings = ProgramSettings()
        self._process: ReadingProcess | None = None
        self._stream: BinaryIO | None = None
        # Made of the check, when it is asked for; None for a run that begins anew.
        self._time_left: TimeLeft | None = None

    @property
    def is_running(self) -> bool:
        """Whether it runs."""
        return self.run is not None and self.run.state is not RunState.ENDED

    @property
    def is_in_work(self) -> bool:
        """Whether it is being read or proved."""
        return self._process is not None

    @property
    def in_work(self) -> str:
        """What is being done with it, in words."""
        return f"{self.name} is being {'proved' if self.read is not None else 'read'}"

    @property
    def is_changed(self) -> bool:
        """Whether the files are others than those that were read."""
        return bool(self.name) and self._marks != self._marks_now()

    @property
    def changed(self) -> str:
        """That the files have changed, in words."""
        return f"{self.name}, the settings of programs or the work zero were changed"

    @property
    def path(self) -> Path:
        """Where the file is.

        Raises:
            KinematicsError: if its name is none of a program, or none is chosen.
        """
        if not self.name:
            raise ProgramFileError("choose a program first")
        return self._folder.path(self.name)

    def take_facts(self, facts: MachineFacts) -> None:
        """Take in what machine it is for; its proof holds for the limits of that time."""
        before, self._facts = self._facts, facts
        if before is None or before.bounds == facts.bounds or self.read is None:
            return
        # A proof that is under way begins anew, with the new bounds.
        is_check = self.is_in_work
        self._is_outdated |= not is_check and bool(self.check or self.error)
        self.check, self.error = None, ""
        if is_check:
            self.prove()

    @property
    def is_of_another_machine(self) -> bool:
        """Whether it was read for another machine than the present one."""
        before, facts = self._read_for, self._facts
        return facts is not None and (before is None or not before.is_same_machine(facts))

    def load(self) -> None:
        """Begin to read the file that is chosen, in place of what was read before."""
        self.close()
        self.read = self.check = self.run = None
        self.error = ""
        self._is_outdated = False
        self._read_for = self._facts
        if self._stream is not None:
            self._stream.close()
            self._stream = None
        if self.name:
            self._marks = self._marks_now()
            try:
                path = self.path
                self._settings = self.settings()
            except KinematicsError as error:
                self.error = shown_text(str(error), self.files[0])
                return
            with suppress(OSError):
                self._stream = path.open("rb")
            self._begin(path, is_check=False)

    def prove(self) -> None:
        """Begin to prove what was read."""
        self.check, self.error, self._is_outdated = None, "", False
        self.close()
        self._begin(self.path, is_check=True)

    def begin_run(self, run: ProgramRun) -> None:
        """Follow a ``run`` of it."""
        self.run, self._time_left = run, None

    def cancel(self) -> None:
        """End what is being done with it; what is not read is not chosen any more."""
        self.close()
        if self.read is None:
            self.name = ""

    def close(self) -> None:
        """End the process that reads, if there is one."""
        if self._process is not None:
            self._process.end()
            self._process = None

    def take_answer(self) -> Answer | None:
        """Take what has been found out about the program; None if that is not there yet."""
        if self._process is None or self._process.answer is None:
            return None
        answer, self._process = self._process.answer, None
        if isinstance(answer, NotRead):
            self.error = answer.reason
        elif isinstance(answer, ProgramCheck):
            self.check, self._time_left = answer, None
        else:
            self.read = answer
        return answer

    def _begin(self, path: Path, *, is_check: bool) -> None:
        if (facts := self._facts) is not None:
            # The workspace, the limits and the shaper are those of now.
            asked = path, self._settings, facts.workspace, *facts.bounds, is_check, self._marks[0]
            self._process = ReadingProcess(Reading(*asked))

    def _marks_now(self) -> tuple[Mark, ...]:
        file = self._folder.folder / self.name
        return tuple(mark_of(each) for each in (file, *self.files))

    def settings(self) -> ProgramSettings:
        """Return what programs do not say themselves, with the work zeros that are kept.

        Raises:
            KinematicsError: if a file has no meaning.
        """
        settings_file, zeros_file = self.files
        settings = with_kept_zeros(load_own_settings(settings_file), zeros_file)
        if self.dialect != FROM_SETTINGS:
            settings = replace(settings, dialect=Dialect(self.dialect))
        if settings.start is None and settings.home is None:
            settings = replace(settings, start=self._shown_machine.commanded_position)
        return settings

    # Texts for the page

    @property
    def outside(self) -> str:
        """Which line leads outside the workspace, in words; empty for none."""
        if self.read is None or not self.read.outside:
            return ""
        return f"line {self.read.outside:,} leads outside the workspace"

    @property
    def text(self) -> str:
        """What is known of it, for the page."""
        parts = []
        if self._process is not None:
            seconds = clock_text(monotonic() - self._process.begun_at)
            text = f"{self.in_work}, since {seconds} (cancel ends it)"
            parts.append(progress(self._process.part, text, is_work=True))
        if self.is_running and self.is_changed:
            text = f"{self.changed}: what runs is what was read before"
            parts.append(note(text, is_bad=True))
        if self.outside:
            parts.append(note(f"{self.outside} (drawn in red)", is_bad=True))
        if self.error:
            parts.append(note(self.error, is_bad=True))
        if self._is_outdated:
            text = "the limits or the shaper have changed since the check: check again"
            parts.append(note(text, is_bad=True))
        if self.read is not None:
            if self.read.program.guess:
                parts.append(note(self.read.program.guess))
            parts.append(table(self._facts_of(self.read)))
            told = self.read.program.told
            words = [f"line {each.line}: {each.word}: {each.reason}" for each in told[:MOST_TOLD]]
            if len(told) > MOST_TOLD:
                words.append(f"and {len(told) - MOST_TOLD} more")
            if words:
                parts.append(note(f"not done: {'; '.join(words)}"))
        return "".join(parts)

    def _facts_of(self, read: ReadProgram) -> list[tuple[str, ...]]:
        rows: list[tuple[str, ...]] = [("lines", f"{read.program.lines:,}")]
        for name, low, high in zip("xyz", read.lower, read.upper):
            rows.append((name, f"{_millimetres(low)} to {_millimetres(high)} mm"))
        if self.check is not None:
            rows.append(("way", f"{_millimetres(self.check.length)} mm"))
            rows.append(("duration", clock_text(self.left(1))))
        else:
            rows.append(("duration", "not known before the check"))
        return rows

    def left(self, line: int, way: float = math.nan, *, is_run: bool = False) -> float:
        """Return how long the program takes from a ``line`` on [s]; NaN before the check.

        Args:
            line: that is driven, or would be.
            way: what is left of the present path [m]; NaN if that is not known.
            is_run: whether it is driven now: then it counts how long it has taken so far.
        """
        if self.check is None or self._facts is None:
            return math.nan
        if self._time_left is None:
            assert self.read is not None
            self._time_left = TimeLeft(self.read.program, self.check)
        values = self._facts.values
        feed = values["path_speed_scale"] * values["speed_scale"]
        scales = Scales(feed, values["rapid_scale"])
        if is_run:
            return self._time_left.look(monotonic(), line, way, scales)
        return self._time_left.at(line, way, scales)

    def text_of(self, line: int) -> str:
        """Return what stands in a ``line`` of the file that was read."""
        starts = self.read.line_starts if self.read is not None else ()
        if self._stream is None or not 0 < line < len(starts):
            return ""
        begin, end = int(starts[line - 1]), int(starts[line])
        try:
            self._stream.seek(begin)
            text = self._stream.read(min(end - begin, 4 * LONGEST_LINE))
        except OSError:
            return ""
        return text.decode("utf-8", "replace").strip()[:LONGEST_LINE]

    def points_at(self, line: int) -> FloatArray:
        """Return the polyline that a ``line`` drives. Shape (n, 3) [m]; empty for none."""
        places: FloatArray = np.empty((0, 3))
        if self.read is not None and line:
            for index in self.read.steps_at(line):
                for run in self.read.program.steps[index].runs:
                    places = points_of_line(run, line)
        return places


def _millimetres(length: float) -> str:
    return number_text(round(1000.0 * length, 3))
