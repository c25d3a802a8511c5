"""Belt, parts and counters of a pick_node, as soon as one is heard."""

from __future__ import annotations

import numpy as np
import viser

from tri_glide_interfaces.msg import PickState
from tri_glide_kinematics.panel.words import table
from tri_glide_kinematics.ros.messages import vector_of

# Parts on the belt, and the one that is picked: red, green and blue.
PART, PICKED = (30, 120, 255), (230, 90, 20)

# Diameter of a part as it is drawn [m].
SIZE = 0.012


class PickView:
    """Shows them in the scene, and in a folder of the tab in which it is made."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Prepare for both; nothing is shown yet."""
        self._server = server
        self._folder = server.gui.add_folder("Picking", visible=False)
        with self._folder:
            self._table = server.gui.add_html("")
        self._shown: PickState | None = None

    def draw(self, state: PickState | None) -> None:
        """Show what was told last, if that is new."""
        if state is None or state is self._shown:
            return
        self._shown = state
        self._folder.visible = True
        # A zero has no sign.
        speed = round(1000.0 * state.belt_velocity, 1) + 0.0
        self._table.content = table(
            [
                ("picking", state.doing, ""),
                ("belt", f"{1000.0 * state.belt_position:.1f} mm", f"{speed:.1f} mm/s"),
                ("parts on the belt", str(len(state.parts)), ""),
                *((name, str(getattr(state, name)), "") for name in COUNTED),
            ]
        )
        places = np.array([vector_of(each) for each in state.positions], dtype=np.float32)
        colors = [PICKED if number == state.target else PART for number in state.parts]
        self._server.scene.add_point_cloud(
            "/parts",
            places.reshape(-1, 3),
            np.array(colors, dtype=np.uint8).reshape(-1, 3),
            point_size=SIZE,
            point_shape="circle",
        )


COUNTED = ("placed", "missed", "lost", "passed")
