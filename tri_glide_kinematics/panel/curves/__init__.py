"""Curves: what the sliders did in the last seconds, beside their limits.

For other parts of the panel: ``Curves`` in ``plots``, ``CurveLimits`` in ``limits``.
"""

from typing import TYPE_CHECKING

from tri_glide_kinematics.lazy import when_first_used

if TYPE_CHECKING:
    from tri_glide_kinematics.panel.curves.plots import ACCELERATIONS as ACCELERATIONS
    from tri_glide_kinematics.panel.curves.plots import BIN as BIN
    from tri_glide_kinematics.panel.curves.plots import HEIGHTS as HEIGHTS
    from tri_glide_kinematics.panel.curves.plots import SPAN as SPAN
    from tri_glide_kinematics.panel.curves.plots import VELOCITIES as VELOCITIES
    from tri_glide_kinematics.panel.curves.plots import CurveLimits as CurveLimits
    from tri_glide_kinematics.panel.curves.plots import Curves as Curves
    from tri_glide_kinematics.panel.curves.plots import History as History

__all__, __getattr__, __dir__ = when_first_used(__name__, __file__)
