"""A wall clock that can be set, for processes started with it: CI may not set the real one.

``wall_clock.c`` is loaded before the C library. A wait of the middleware has a deadline by this
clock, as one has where the C++ library knows no waiting by the steady clock.
"""

import os
import subprocess
from pathlib import Path
from struct import pack

HOUR = 3600.0  # s


class WallClock:
    """A clock that is ahead of that of the computer, or behind it.

    Attributes:
        prefix: starts a command with this clock.
    """

    def __init__(self, folder: Path) -> None:
        """Put what is needed into a ``folder``."""
        library, self._file = folder / "wall_clock.so", folder / "ahead"
        source = Path(__file__).with_suffix(".c")
        command = ["cc", "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"]
        subprocess.run(command, check=True)
        self.set_ahead(0.0)
        self.prefix = ("env", f"LD_PRELOAD={library}", f"WALL_CLOCK_AHEAD={self._file}")

    def set_ahead(self, seconds: float) -> None:
        """Set it, at once and for all who have it; behind where ``seconds`` are negative."""
        descriptor = os.open(self._file, os.O_RDWR | os.O_CREAT)
        os.pwrite(descriptor, pack("d", seconds), 0)
        os.close(descriptor)
