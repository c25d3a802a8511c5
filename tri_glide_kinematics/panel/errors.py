"""Errors of the panel."""

from __future__ import annotations

from pathlib import Path

from tri_glide_kinematics.errors import KinematicsError


class PanelError(KinematicsError):
    """The panel cannot do what it is asked for; the text says why."""


class PortTakenError(PanelError):
    """Somebody else listens where the page should be."""

    def __init__(self, host: str, port: int) -> None:
        """Keep the address."""
        self.host, self.port = host, port
        super().__init__(f"port {port} of {host} is in use: choose another one with -p port:=...")


class TokenFileError(PanelError):
    """The token in the address of the page cannot be kept."""

    def __init__(self, file: Path, reason: str) -> None:
        """Keep the ``file`` and why it is of no use."""
        self.file, self.reason = file, reason
        super().__init__(
            f"the token of the page cannot be kept in {file}: {reason}; "
            "mend this, or choose another file with -p token_file:=..."
        )


class UnguardedPageError(PanelError):
    """The page would be open to everybody, as viser does not serve it the way it did."""

    def __init__(self, version: str) -> None:
        """Keep the ``version`` of viser."""
        self.version = version
        super().__init__(
            f"viser {version} does not let this panel refuse connections: install viser==1.1.1"
        )
