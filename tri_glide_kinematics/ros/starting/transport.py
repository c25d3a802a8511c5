"""Chooses how messages travel, before rclpy is initialised: by UDP, without shared memory.

The shared memory of Fast DDS, the usual middleware of ROS 2, can hold every process of a
domain for a third of a second and longer when one of them ends without a clean shutdown.
``docs/middleware.md`` says more, and what was measured.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from tri_glide_kinematics.errors import KinematicsError

VARIABLE = "TRI_GLIDE_TRANSPORT"
COMPUTER, CELL = "computer", "cell"
MEANINGS = {
    COMPUTER: "UDP on the loopback address alone: nothing leaves this computer",
    CELL: "UDP on all network interfaces",
}
PROFILE_OF = {COMPUTER: "fast_dds_loopback.xml", CELL: "fast_dds_cell.xml"}

MIDDLEWARE = "RMW_IMPLEMENTATION"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
ONLY_LOCALHOST = "ROS_LOCALHOST_ONLY"
BUILTIN = "FASTDDS_BUILTIN_TRANSPORTS"
PROFILES, OLD_PROFILES = "FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE"
# These name other hosts: a cell may have them, the loopback address does not reach them.
OTHER_HOSTS = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")
MIDDLEWARE_VARIABLES = (
    *(MIDDLEWARE, RANGE, ONLY_LOCALHOST, BUILTIN, OLD_PROFILES, PROFILES),
    *OTHER_HOSTS,
)


class ProfileSources(NamedTuple):
    """Where a version of Fast DDS gets its profiles from.

    Attributes:
        variables: that name a file; the first one is the one to set.
        file: that it reads in the working directory.
    """

    variables: tuple[str, ...]
    file: str


# Fast DDS 2, as in Jazzy, and Fast DDS 3, as in Kilted: rmw_fastrtps still takes the old variable
# there, with a warning.
SOURCES_OF_2 = ProfileSources((OLD_PROFILES,), "DEFAULT_FASTRTPS_PROFILES.xml")
SOURCES_OF_3 = ProfileSources((PROFILES, OLD_PROFILES), "DEFAULT_FASTDDS_PROFILES.xml")

FAST_DDS = ("rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp")
# From this version of rmw_fastrtps_cpp on it is Fast DDS 3.
FIRST_WITH_FAST_DDS_3 = 9
WITHOUT_SHARED_MEMORY = ("UDPv4", "UDPv6")


class TransportError(KinematicsError):
    """The variable ``TRI_GLIDE_TRANSPORT`` has a value without a meaning."""

    def __init__(self, value: str) -> None:
        """Keep the value."""
        self.value = value
        super().__init__(f"{VARIABLE} = {value!r} must be one of {', '.join(MEANINGS)}")


class Transport(NamedTuple):
    """How messages travel.

    Attributes:
        text: says it in a line, for the log.
        variables: to be set in the environment.
        can_stall: whether shared memory is in use.
    """

    text: str
    variables: dict[str, str]
    can_stall: bool = False


def choose_transport(default: str = CELL) -> Transport:
    """Choose by the environment of this process, and set its variables accordingly.

    Processes that are started afterwards inherit the choice. Without ``TRI_GLIDE_TRANSPORT`` it is
    ``default``.

    Raises:
        TransportError: if that variable has another value than ``computer`` or ``cell``.
    """
    transport = transport_of(os.environ, default)
    os.environ.update(transport.variables)
    return transport


def transport_of(environment: Mapping[str, str], default: str = CELL) -> Transport:
    """Return what to use in ``environment``; what is set there for the middleware itself wins.

    Empty variables count as not set, and ``default`` holds without ``TRI_GLIDE_TRANSPORT``.

    Raises:
        TransportError: if that variable has another value than ``computer`` or ``cell``.
    """
    name = environment.get(VARIABLE) or default
    if name not in MEANINGS:
        raise TransportError(name)
    set_up = {RANGE: "SUBNET", profile_sources().variables[0]: str(profile(name))}
    if name == CELL:
        set_up[BUILTIN] = "UDPv4"
    found = {key: environment.get(key) or "" for key in MIDDLEWARE_VARIABLES}
    if not _contradictions(name, set_up, found):
        return Transport(f"{VARIABLE}={name}: {MEANINGS[name]}", {VARIABLE: name, **set_up})
    own = ", ".join(f"{key}={value}" for key, value in found.items() if value)
    own = own or f"the file {profile_sources().file} in the working directory"
    text = f"transport as chosen by {own}; {VARIABLE}={name} has no effect"
    if not _has_shared_memory(found):
        return Transport(text, {VARIABLE: name})
    text += (
        ": this brings shared memory, which can hold all nodes for a second when a process ends "
        f"without a clean shutdown; unset it, and set {VARIABLE} to {COMPUTER} (this computer "
        f"only) or {CELL} (several hosts)"
    )
    return Transport(text, {VARIABLE: name}, can_stall=True)


def profile(name: str) -> Path:
    """Return the installed profile of Fast DDS for the set-up with this ``name``."""
    share = get_package_share_directory("tri_glide_kinematics")
    return Path(share, "config", PROFILE_OF[name])


def profile_sources() -> ProfileSources:
    """Return where the installed Fast DDS gets its profiles from."""
    with suppress(PackageNotFoundError):
        manifest = Path(get_package_share_directory(FAST_DDS[0]), "package.xml")
        major = re.search(r"<version>(\d+)", manifest.read_text(encoding="utf-8"))
        if major and int(major[1]) >= FIRST_WITH_FAST_DDS_3:
            return SOURCES_OF_3
    return SOURCES_OF_2


def _contradictions(name: str, set_up: Mapping[str, str], found: Mapping[str, str]) -> bool:
    """Tell whether the middleware's own variables ask for something else than the set-up."""
    agreeing = {
        **{key: ("", value) for key, value in set_up.items()},
        MIDDLEWARE: ("", *FAST_DDS),
        ONLY_LOCALHOST: ("", "0"),
    }
    return (
        any(
            value not in agreeing.get(key, ("",))
            for key, value in found.items()
            if not (name == CELL and key in OTHER_HOSTS)
        )
        or Path(profile_sources().file).is_file()
    )


def _has_shared_memory(found: Mapping[str, str]) -> bool:
    """Tell whether Fast DDS uses shared memory with these variables, as far as they say it."""
    if found[MIDDLEWARE] not in ("", *FAST_DDS):
        return False
    # rmw_fastrtps adds it in this range, whatever the others say.
    if found[RANGE] == "LOCALHOST" or found[ONLY_LOCALHOST] == "1":
        return True
    sources = profile_sources()
    if any(found[name] for name in sources.variables) or Path(sources.file).is_file():
        return False  # the file decides, and whoever wrote it
    return found[BUILTIN] not in WITHOUT_SHARED_MEMORY
