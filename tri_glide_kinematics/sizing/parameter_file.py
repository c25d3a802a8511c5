"""The parameter file that starts all nodes with a machine that was sized."""

from __future__ import annotations

from tri_glide_kinematics.sizing.sizing import Sizing
from tri_glide_kinematics.sizing.wish import Box
from tri_glide_kinematics.wording import number_text

FIRST_LINE = "# Parameters of a machine that was sized by tri_glide_kinematics."


def parameter_text(sizing: Sizing) -> str:
    """Return a parameter file for all nodes, with its last line ended.

    The platform may be in all of the wanted volume, and nowhere else. The simulator begins in its
    middle.

    Args:
        sizing: the machine.
    """
    limits, bounds = sizing.slider_limits(), sizing.workspace_limits()
    volume = sizing.wish.volume
    if isinstance(volume, Box):
        middle = tuple(0.5 * (low + high) for low, high in zip(volume.lower, volume.upper))
        space = [
            ("space", "box"),
            ("box_lower", _list(volume.lower)),
            ("box_upper", _list(volume.upper)),
        ]
    else:
        middle = (volume.center_x, volume.center_y, 0.5 * (volume.z_min + volume.z_max))
        space = [
            ("space", "cylinder"),
            ("cylinder_center", _list((volume.center_x, volume.center_y))),
            ("cylinder_radius", _number(volume.radius)),
            ("cylinder_z", _list((volume.z_min, volume.z_max))),
        ]
    lines = [
        ("geometry", "symmetric"),
        ("base_radius", _number(sizing.base_radius)),
        ("platform_radius", _number(sizing.platform_radius)),
        ("arm_length", _number(sizing.arm_length)),
        ("orientation", _number(sizing.wish.orientation)),
        ("lower_heights", _list(bounds.lower_heights)),
        ("upper_heights", _list(bounds.upper_heights)),
        ("velocity_limits", _list(limits.velocity)),
        ("acceleration_limits", _list(limits.acceleration)),
        ("jerk_limits", _list(limits.jerk)),
        ("reach_margin", _number(bounds.reach_margin)),
        ("max_condition_number", _number(bounds.max_condition_number)),
        *space,
        ("initial_heights", _list(sizing.machine.inverse(middle))),
        ("encoder_resolution", _number(sizing.wish.drive_resolution)),
    ]
    head = [FIRST_LINE, "", "/**:", "  ros__parameters:"]
    return "\n".join([*head, *(f"    {name}: {text}" for name, text in lines), ""])


def _number(value: float) -> str:
    """Return a number as YAML takes it for one with decimals."""
    text = number_text(value, 12, 0.0)
    if "." in text:
        return text
    return text.replace("e", ".0e") if "e" in text else f"{text}.0"


def _list(values: tuple[float, ...]) -> str:
    return f"[{', '.join(map(_number, values))}]"
