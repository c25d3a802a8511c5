"""Finds files that come with the package; writes files whole or not at all, over no other one."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from tri_glide_kinematics.errors import KinematicsError

BACKUP = ".bak"
NO_REGULAR_FILE = "it is there, and no regular file"

# Whose configuration files are looked for.
PACKAGE = "tri_glide_kinematics"

# Files in config/ that are taken where none is named.
PARAMETERS = "tri_glide.yaml"
SETTINGS = "program_settings.yaml"


class OutsideFolderError(KinematicsError):
    """A file lies outside the folder that it has to be in."""

    def __init__(self, file: str, folder: Path) -> None:
        """Store the name of the ``file`` as it was given, and the ``folder``."""
        super().__init__(f"{file!r} is no file in the folder {folder}")
        self.file = file
        self.folder = folder


class NoHomeError(KinematicsError):
    """The user has no folder for what is kept from one start to the next."""


def find_file(file: Path) -> Path:
    """Return ``file``, or if there is none, the installed configuration file of that name."""
    if not file.exists() and file.name == str(file):
        for folder in _shared_folders():
            installed = folder / "config" / file.name
            if installed.exists():
                return installed
    return file


def _shared_folders() -> Iterator[Path]:
    """Yield the folders that may have the files of this package that are no modules.

    ROS keeps the folders in which packages are installed in the environment. pip installs them into
    one that has the modules somewhere inside, and leaves all where it is if it is told ``-e``.
    """
    prefixes = map(Path, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep))
    package = Path(__file__).parent
    for prefix in (*prefixes, *package.parents):
        yield prefix / "share" / PACKAGE
    yield package.parent


def state_folder() -> Path:
    """Return the folder of what is kept for this user, by the XDG Base Directory Specification.

    Raises:
        NoHomeError: if the user has no home.
    """
    state = Path(os.environ.get("XDG_STATE_HOME", ""))
    # By the specification, a relative path has no meaning.
    if not state.is_absolute():
        try:
            state = Path.home() / ".local" / "state"
        except RuntimeError as error:
            raise NoHomeError(str(error)) from error
    return state / "tri_glide_kinematics"


def file_of_machine(name: str, namespace: str) -> Path:
    """Return where something is kept for the machine in a ``namespace``, by the ``name`` of it.

    Raises:
        NoHomeError: if the user has no home.
    """
    return state_folder() / "_".join((name, *filter(None, namespace.split("/"))))


def file_in(folder: Path, name: str) -> Path:
    """Return the path of a file in a folder, links followed.

    Args:
        folder: that somebody has chosen.
        name: that somebody else asks for, relative to the folder or absolute.

    Raises:
        OutsideFolderError: if the file would be elsewhere, or the name is none.
    """
    folder = folder.resolve()
    try:
        file = (folder / name).resolve()
    except (ValueError, OSError, RuntimeError):
        # A zero byte, a name that is too long, links that lead in a circle.
        raise OutsideFolderError(name, folder) from None
    if folder not in file.parents:
        raise OutsideFolderError(name, folder)
    return file


def parameter_file(head: Iterable[str], node: str, rows: Iterable[tuple[str, object, str]]) -> str:
    """Return a parameter file of ROS, its last line ended.

    It has one section, in braces: so a file that is cut off is refused.

    Args:
        head: its first lines, as comments without their sign.
        node: whose parameters they are; ``/**`` for those of all nodes.
        rows: name of each parameter, its value as YAML has it, and its unit or a remark.
    """
    lines = [f"  {name}: {value},{f' # {remark}' * bool(remark)}" for name, value, remark in rows]
    section = f"{node}: {{ros__parameters: {{"
    return "\n".join((*(f"# {line}" for line in head), section, *lines, "}}\n"))


def write_file(file: str | Path, content: str | bytes) -> None:
    """Write a file, all of it or nothing; when this returns, it is on the disk.

    Raises:
        OSError: if it cannot be written, or what is there is no regular file but a device, for
            instance; what was there before still is.
    """
    with _naming(file):
        _put(Path(file).resolve(), content, keeps_old=False)


def check_place(file: str | Path, text: str) -> None:
    """Check that what stands where ``replace_file`` writes may be replaced; raises as it does."""
    with _naming(file):
        if Path(file).exists():
            _checked_content(Path(file), text.split("\n", 1)[0])


def replace_file(file: str | Path, text: str) -> None:
    """Write a file as ``write_file`` does, and keep what was there before.

    That becomes ``NAME.bak``, or ``NAME.bak2`` and so on if there is one already: nothing is
    overwritten. If the same text is there, nothing is done.

    Args:
        file: where. A file that is there must begin with the same line as the text.
        text: its first line tells what wrote it.

    Raises:
        OSError: if it cannot be written, or another wrote what is there.
    """
    place = Path(file).resolve()
    with _naming(file):
        is_new = not place.exists()
        if is_new or _checked_content(place, text.split("\n", 1)[0]) != text.encode():
            _put(place, text, keeps_old=not is_new)


@contextmanager
def _naming(file: str | Path) -> Iterator[None]:
    """Let an OSError name the ``file`` that is wanted, not the one beside it that is written."""
    try:
        yield
    except OSError as error:
        # Of a rename there are two.
        del error.filename2
        error.filename = str(file)
        raise


def _put(file: Path, content: str | bytes, *, keeps_old: bool) -> None:
    if file.exists() and not file.is_file():
        raise OSError(errno.EINVAL, NO_REGULAR_FILE)
    new = file.with_name(f"{file.name}.{os.getpid()}.new")
    try:
        with new.open("wb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
            stream.flush()
            os.fsync(stream.fileno())
        if keeps_old:
            _keep(file)
        new.replace(file)
    finally:
        new.unlink(missing_ok=True)
    # The name of a file is on the disk when its folder is.
    descriptor = os.open(file.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _keep(file: Path) -> None:
    """Give a file a second name, or, where the file system has no links, another one."""
    for number in count(1):
        backup = file.with_name(f"{file.name}{BACKUP}{number if number > 1 else ''}")
        try:
            # Takes no room on the disk, and never the place of another file.
            os.link(file, backup)
        except FileExistsError:
            continue
        except OSError as error:
            if error.errno not in (errno.EPERM, errno.ENOTSUP, errno.EMLINK) or backup.exists():
                raise
            file.rename(backup)
        return


def _checked_content(file: Path, first: str) -> bytes:
    if not file.is_file():
        raise OSError(errno.EINVAL, NO_REGULAR_FILE)
    content = file.read_bytes()
    if not content.startswith(first.encode()):
        raise FileExistsError(
            errno.EEXIST, f"it is there, and its first line is not {first!r}: choose another"
        )
    return content
