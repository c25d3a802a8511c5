"""What the panel cannot do."""

from __future__ import annotations

from tri_glide_kinematics.errors import KinematicsError


class PanelError(KinematicsError):
    """The panel cannot do what it is asked for; the text says why."""


class PortTakenError(PanelError):
    """Somebody else listens where the page should be."""

    def __init__(self, host: str, port: int) -> None:
        """Keep the address."""
        self.host, self.port = host, port
        super().__init__(f"port {port} of {host} is in use: choose another one with -p port:=...")
