"""The parameters of each node, as data: one entry says all there is to know about one of them.

Declaration, checks and documentation are derived from it. No ROS in here.
``python -m tri_glide_kinematics.settings.tables`` prints a page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

from tri_glide_kinematics.checks import plain_float
from tri_glide_kinematics.dynamics import MIDDLE, STANDARD_GRAVITY
from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.motion.shaping import (
    HIGHEST_FREQUENCY,
    LOWEST_FREQUENCY,
    MOST_DAMPING,
    ShaperKind,
)
from tri_glide_kinematics.motion.tracking import FOLLOW_HORIZON, LONGEST_HORIZON
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY
from tri_glide_kinematics.wording import number_text

Value: TypeAlias = Any
Values: TypeAlias = Mapping[str, Value]

TYPE_NAMES = {bool: "bool", int: "integer", float: "double", str: "string"}


class ParameterError(KinematicsError):
    """A parameter has a value that its node cannot work with."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a node.

    Attributes:
        name: as in the parameter file.
        default: its type is the type of the parameter; a tuple stands for an array of fixed size.
        meaning: one line.
        unit: SI unit, empty if there is none.
        minimum: least value allowed, of each element in an array.
        maximum: greatest value allowed, of each element in an array.
        choices: the only values allowed, of each element in an array.
        live: whether it can be set while the node runs.
        any_size: whether an array may have another number of elements (but not none).
        told: whether a node names it at its start, even if it has its default.
    """

    name: str
    default: Value
    meaning: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    live: bool = False
    any_size: bool = False
    told: bool = False

    @property
    def is_array(self) -> bool:
        """Whether the value is an array."""
        return isinstance(self.default, tuple)

    @property
    def element_type(self) -> type[Any]:
        """Type of the value, or of each element in an array."""
        return type(self.default[0] if self.is_array else self.default)

    @property
    def type_name(self) -> str:
        """Type in words, for example ``double[3]``."""
        name = TYPE_NAMES[self.element_type]
        if not self.is_array:
            return name
        return f"{name}[]" if self.any_size else f"{name}[{len(self.default)}]"

    @property
    def bounds(self) -> str:
        """The values allowed, in words; empty if all are."""
        if self.choices:
            return ", ".join(f"`{choice}`" for choice in self.choices)
        if self.minimum is not None and self.maximum is not None:
            return f"{self.minimum:g} to {self.maximum:g}"
        return ""

    @property
    def description(self) -> str:
        """Meaning and unit, as a tool shows them."""
        return f"{self.meaning} [{self.unit}]" if self.unit else self.meaning

    def checked(self, value: Value) -> Value:
        """Return ``value``, an array as a tuple, and integers as doubles where these are wanted.

        Raises:
            ParameterError: if the type or the number of elements is wrong, or an element is no
                valid choice.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is outside the bounds.
        """
        if not self.is_array:
            return self._checked(self.name, value)
        if isinstance(value, tuple(TYPE_NAMES)):
            raise ParameterError(f"{self.name} = {value!r} must be an array, {self.type_name}")
        # ROS gives an empty array without a type the value None.
        elements = () if value is None else tuple(value)
        wanted = len(self.default)
        if not elements or (len(elements) != wanted and not self.any_size):
            expected = "at least one" if self.any_size else str(wanted)
            raise ParameterError(f"{self.name} has {len(elements)} elements, expected {expected}")
        return tuple(
            self._checked(f"{self.name}[{index}]", element)
            for index, element in enumerate(elements)
        )

    def text(self, value: Value) -> str:
        """Return a value of this parameter with its unit, for a line in the log."""
        if self.is_array:
            text = "[" + ", ".join(map(_as_text, value)) + "]"
        else:
            text = _as_text(value)
        return f"{text} {self.unit}" if self.unit else text

    def _checked(self, name: str, value: Value) -> Value:
        if self.element_type is float and type(value) is int:
            value = plain_float(name, value)
        if type(value) is not self.element_type:
            wanted = TYPE_NAMES[self.element_type]
            raise ParameterError(f"{name} = {_shown(value)} must be a {wanted}")
        if self.choices and value not in self.choices:
            raise ParameterError(f"{name} = {value!r} must be one of {', '.join(self.choices)}")
        if isinstance(value, float) and not math.isfinite(value):
            raise NotFiniteError(name, value)
        if self.minimum is not None and value < self.minimum:
            raise OutOfBoundsError(name, value, f"at least {self.minimum:g}", self.unit)
        if self.maximum is not None and value > self.maximum:
            largest = self.maximum if self.unit == "m" else math.inf
            raise OutOfBoundsError(name, value, f"at most {self.maximum:g}", self.unit, largest)
        return value


def markdown_table(parameters: Iterable[Parameter]) -> str:
    """Return the parameters as a table in Markdown."""
    lines = [
        "| parameter | type | default | unit | bounds | live | meaning |",
        "|---|---|---|---|---|---|---|",
    ]
    for parameter in parameters:
        cells = (
            f"`{parameter.name}`",
            parameter.type_name,
            f"`{_as_yaml(parameter.default)}`",
            parameter.unit,
            parameter.bounds,
            "yes" if parameter.live else "no",
            parameter.meaning,
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def plain_list(parameters: Iterable[Parameter]) -> str:
    """Return the parameters as text for a terminal, two lines each."""
    lines = []
    for parameter in parameters:
        facts = (
            f"{parameter.type_name} {parameter.unit}".rstrip(),
            f"default {_as_yaml(parameter.default)}",
            parameter.bounds.replace("`", ""),
            "live" if parameter.live else "",
        )
        lines.append(f"  {parameter.name} ({'; '.join(filter(None, facts))})")
        lines.append(f"      {parameter.meaning.replace('`', '')}")
    return "\n".join(lines)


def start_text(parameters: Iterable[Parameter], values: Values) -> str:
    """Return what a node says about its parameters at its start: the main and the changed ones."""
    texts = []
    table = tuple(parameters)
    if not table:
        return "no parameters"
    for parameter in table:
        value = values[parameter.name]
        changed = value != parameter.default
        if changed or parameter.told:
            default = f" (default {parameter.text(parameter.default)})" if changed else ""
            texts.append(f"{parameter.name} {parameter.text(value)}{default}")
    return ", ".join([*texts, "all else as by default"])


def change_text(parameters: Iterable[Parameter], before: Values, after: Values) -> str:
    """Return which values differ, for example ``speed_scale: 1 -> 0.5``; empty if none does."""
    return ", ".join(
        f"{parameter.name}: {parameter.text(old)} -> {parameter.text(new)}"
        for parameter in parameters
        if (old := before[parameter.name]) != (new := after[parameter.name])
    )


def _shown(value: Value) -> str:
    """Return a value of the wrong type as text; what ROS makes of an empty array is None."""
    if isinstance(value, (bytes, *TYPE_NAMES)):
        return repr(value)
    return str(list(value or ()))


def _as_text(value: Value) -> str:
    return number_text(value, scale=0.0) if isinstance(value, float) else _as_yaml(value)


def _as_yaml(value: Value) -> str:
    """Return a value as one would write it in a parameter file."""
    if isinstance(value, tuple):
        return "[" + ", ".join(_as_yaml(element) for element in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)


# A parameter that can be set while its node runs.
live = partial(Parameter, live=True)

# One number for each slider, arm or axis.
ZEROS = (0.0, 0.0, 0.0)

# Unit, least and greatest value.
PLACE = ("m", -10.0, 10.0)
MASS = ("kg", 0.0, 1e4)
PART = ("", 0.0, 1.0)

# No force is larger: the limit of a direction in which none is asked for [N].
MOST_FORCE = 1e6

# The rows are laid out by hand: name and default, meaning, unit and bounds.
# fmt: off
JOINT_NAMES = Parameter("joint_names", ("slider_1", "slider_2", "slider_3"),
    "names of the sliders in JointState messages")
BASE_FRAME = Parameter("base_frame", "tri_glide_base", "frame of poses and twists")
# Where the drives count from has nothing to do with where they may go: so the travel stays what it
# is when the offsets get known.
TRAVEL = (
    Parameter("lower_heights", (0.3, 0.3, 0.3),
        "lower end of each slider's travel, as the drives report it", *PLACE),
    Parameter("upper_heights", (0.9, 0.9, 0.9),
        "upper end of each slider's travel, as the drives report it", *PLACE),
)
DRIVE_DELAY = Parameter("drive_delay", 0.0,
    "time from a setpoint to the motors, as that of drives that play setpoints out: measured "
    "heights are compared with the setpoint of then, and outputs on a path wait for so long",
    "s", 0.0, 0.5)

GEOMETRY = (
    Parameter("geometry", "symmetric",
        "`symmetric`: the next four parameters hold; `calibrated`: the two after them",
        choices=("symmetric", "calibrated"), told=True),
    Parameter("base_radius", 0.25, "radius of the circle through the tower joints", "m", 0.0, 10.0),
    Parameter("platform_radius", 0.05,
        "radius of the circle through the platform joints", "m", 0.0, 10.0),
    Parameter("arm_length", 0.4, "length of each arm", "m", 0.001, 10.0),
    Parameter("orientation", 0.0,
        "angle of the first tower, from the y axis", "rad", -6.2832, 6.2832),
    Parameter("anchors",
        tuple(round(number, 9) + 0.0 for anchor in DEFAULT_GEOMETRY.anchors for number in anchor),
        "x1, y1, x2, y2, x3, y3: tower joint minus platform joint of each arm", *PLACE),
    Parameter("arm_lengths", DEFAULT_GEOMETRY.arm_lengths, "length of each arm", "m", 0.001, 10.0),
    Parameter("height_offsets", ZEROS,
        "true height of each slider minus the height that its drive reports and is commanded",
        "m", -1.0, 1.0),
)

LIMITS = (
    live("velocity_limits", (1.0, 1.0, 1.0),
        "largest velocity of each slider", "m/s", 0.001, 100.0, told=True),
    live("acceleration_limits", (10.0, 10.0, 10.0),
        "largest acceleration of each slider", "m/s^2", 0.01, 1000.0, told=True),
    live("jerk_limits", (200.0, 200.0, 200.0),
        "largest jerk of each slider", "m/s^3", 0.1, 1e5, told=True),
    live("speed_scale", 1.0,
        "factor by which the velocity limits are reduced", "", 0.001, 1.0, told=True),
    live("path_speed_scale", 1.0,
        "factor of the platform speeds that paths ask for (speed override); limits do not change",
        "", 0.01, 2.0, told=True),
    live("rapid_scale", 1.0,
        "rapid override: largest platform speed where paths ask for none, as a part of the largest "
        "velocity limit; 1: no such bound", "", 0.01, 1.0, told=True),
)
PLATFORM_SPEED = live("platform_speed_limit", 0.0,
    "largest speed of the platform in all motion; 0 for none", "m/s", 0.0, 100.0)
# All are as they are by default, or carriages and platform have a mass.
MASSES = (
    live("carriage_masses", ZEROS,
        "mass of each carriage, with the rotating parts of its drive: their inertia over the "
        "square of the way for a radian; 0 where no masses are known", *MASS),
    live("arm_masses", ZEROS, "mass of each arm, both of its rods", *MASS),
    live("arm_centres", (MIDDLE, MIDDLE, MIDDLE),
        "distance of each arm's centre of mass from the joint at the carriage, as a part of its "
        "length; another one than 0.5 needs `arm_inertias`", *PART),
    live("arm_inertias", ZEROS,
        "inertia of each arm, both of its rods, about an axis across it through its centre of "
        "mass; 0 for uniform rods", "kg m^2", 0.0, 1e4),
    live("platform_mass", 0.0,
        "mass of the platform with its tool; 0 where no masses are known", *MASS),
    live("payload", 0.0, "mass of what the platform carries, on its axis", *MASS),
    live("counterweight_masses", ZEROS,
        "mass that hangs on a rope over a pulley at each carriage", *MASS),
    live("coulomb_friction", ZEROS,
        "dry friction of each slider, whatever its speed", "N", 0.0, 1e5),
    live("viscous_friction", ZEROS, "friction of each slider for its speed", "N s/m", 0.0, 1e5),
    live("gravity", STANDARD_GRAVITY,
        "acceleration of free fall in the base frame", "m/s^2", -100.0, 100.0),
)
FORCE_LIMITS = (
    live("force_limit_up", ZEROS,
        "largest force of each slider upwards in all motion; 0 for none; needs masses",
        "N", 0.0, MOST_FORCE),
    live("force_limit_down", ZEROS,
        "largest force of each slider downwards in all motion; 0 for none; needs masses",
        "N", 0.0, MOST_FORCE),
)
DRIVES = (
    live("drive_stiffness", ZEROS,
        "force of each drive for each metre between setpoint and slider; 0 for drives that do not "
        "exert forces; needs masses", "N/m", 0.0, 1e9),
    live("drive_damping", ZEROS,
        "force of each drive for each metre per second between the velocities; greater than 0 "
        "where there is a stiffness", "N s/m", 0.0, 1e9),
)
FORCE_WINDOW = Parameter("force_window", 10.0,
    "time over which the continuous force of each slider is told in `/diagnostics`",
    "s", 0.1, 3600.0)
NO_SHAPER = "none"
SHAPING = (
    live("shaper", NO_SHAPER,
        "shaper that leaves no vibration of the modes behind; a new one is in force from the next "
        "rest on", choices=(NO_SHAPER, *(kind.value for kind in ShaperKind))),
    live("mode_frequencies", (15.0,),
        "of one mode of vibration or two, without damping; for each of `mode_places`, one by one",
        "Hz", LOWEST_FREQUENCY, HIGHEST_FREQUENCY, any_size=True),
    live("mode_dampings", (0.05,),
        "of the modes, as part of their critical damping: one for all, or one for each frequency",
        "", 0.0, MOST_DAMPING, any_size=True),
    live("mode_places", ZEROS,
        "x, y, z of each place of the platform at which the modes are known; one stands for all",
        *PLACE, any_size=True),
)
WORKSPACE = (
    Parameter("reach_margin", 0.005,
        "least difference between the length of an arm and that of its horizontal part",
        "m", 0.0, 1.0),
    Parameter("max_condition_number", 6.0,
        "largest condition number of the Jacobian", "", 1.001, 1e6),
    Parameter("space", "unlimited",
        "shape that the platform centre must not leave; the parameters below give it",
        choices=("unlimited", "box", "cylinder")),
    Parameter("box_lower", (-0.1, -0.1, 0.0), "lower corner of the box", *PLACE),
    Parameter("box_upper", (0.1, 0.1, 0.5), "upper corner of the box", *PLACE),
    Parameter("cylinder_center", (0.0, 0.0), "x and y of the cylinder's axis", *PLACE),
    Parameter("cylinder_radius", 0.12, "radius of the cylinder", "m", 0.001, 10.0),
    Parameter("cylinder_z", (0.0, 0.5), "lower and upper end of the cylinder", *PLACE),
)
SUPERVISION = (
    live("measured_timeout", 0.2,
        "fault if no measured heights arrive for longer than this", "s", 0.005, 10.0),
    live("jump_limit", 0.02,
        "fault if a measured height changes by more than `velocity_limits` allow, plus this",
        "m", 1e-4, 10.0),
    live("tracking_error_limit", 0.05,
        "fault if a measured height is farther than this from the commanded one", "m", 1e-4, 10.0),
)

IN_POSITION = (
    live("position_tolerance", 0.0005,
        "a target is reached if the platform is measured within this distance of it",
        "m", 1e-6, 1.0),
    live("settling_time", 0.02, "time for which it has to stay there", "s", 0.0, 10.0),
    live("settling_timeout", 1.0,
        "longest time from the last setpoint of a motion until the target is reached",
        "s", 0.01, 60.0),
    live("position_error_limit", 0.005,
        "fault if the platform is farther than this from the target after that time",
        "m", 1e-6, 1.0),
)

SYSTEM = (
    Parameter("realtime_priority", 0,
        "priority among processes that come before all ordinary ones (SCHED_FIFO); 0 for an "
        "ordinary one", "", 0, 99),
    Parameter("lock_memory", False, "whether the memory of the node is never swapped out"),
    Parameter("cpu_core", -1, "core on which the node stays; -1 for any", "", -1, 4095),
)

IK_NODE = (
    *GEOMETRY,
    JOINT_NAMES,
    BASE_FRAME,
    Parameter("platform_frame", "tri_glide_platform",
        "frame of the platform, with the axes of the base frame; velocities may be given in it"),
    Parameter("rate", 500.0, "setpoints per second", "1/s", 10.0, 2000.0, told=True),
    *TRAVEL,
    *LIMITS,
    PLATFORM_SPEED,
    *MASSES,
    *FORCE_LIMITS,
    FORCE_WINDOW,
    *SHAPING,
    Parameter("motion", "linear",
        "`linear`: the platform moves in a straight line; `slider`: on a curve, in less time",
        choices=("linear", "slider"), told=True),
    live("twist_timeout", 0.1,
        "a jog stops if no twist arrives for longer than this", "s", 0.01, 10.0),
    live("target_timeout", 0.5,
        "the machine stops if no state of a moving target arrives for longer than this",
        "s", 0.01, 10.0),
    live("program_timeout", 1.0,
        "the machine stops, and outputs become safe, if what drives a program tells nothing for "
        "longer than this", "s", 1.0, 60.0),
    Parameter("fault_recordings", True,
        "whether the 10 s before each fault are kept in a file; of a machine the last five are"),
    live("follow_poses", False,
        "whether poses come at a rate and are followed, like a target that moves; the last one is "
        "reached"),
    live("follow_horizon", FOLLOW_HORIZON,
        "time in which the platform is to be on a moving target, or at the velocity of a jog that "
        "changes in motion: the longer, the calmer; 0 for one cycle", "s", 0.0, LONGEST_HORIZON),
    live("tracking_latency", 0.0,
        "time for which a moving target is extrapolated, as the drives are late", "s", -0.5, 0.5),
    DRIVE_DELAY,
    Parameter("drives_enable", "",
        "service that gives the drives torque (std_srvs/SetBool): `~/enable` asks it first, and "
        "takes the torque away last; empty for none"),
    live("path_tolerance", 0.001,
        "tolerance of the corners of a path that gives none", "m", 0.0, 1.0),
    Parameter("start_disabled", False, "whether `~/enable` has to be called before any motion"),
    *WORKSPACE,
    *SUPERVISION,
    *IN_POSITION,
    Parameter("command_outputs", ("joint_state",), "forms in which the setpoints are published",
        choices=("joint_state", "forward_command", "joint_trajectory"), any_size=True),
    Parameter("trajectory_step", 0.01,
        "time between the points of a published trajectory", "s", 0.001, 1.0),
    Parameter("state_publish_rate", 50.0,
        "messages of `~/motion_state` while somebody listens; above `rate`, one in each cycle",
        "1/s", 5.0, 2000.0),
    *SYSTEM,
)

FK_NODE = (*GEOMETRY, JOINT_NAMES, BASE_FRAME, *SYSTEM)

SIMULATOR_NODE = (
    # The machine as it truly is; that the nodes know it so is not a matter of course.
    *GEOMETRY,
    JOINT_NAMES,
    BASE_FRAME,
    Parameter("platform_frame", "tri_glide_platform", "frame of the accelerometer"),
    *TRAVEL,
    Parameter("rate", 500.0, "measurements per second", "1/s", 1.0, 2000.0, told=True),
    Parameter("initial_heights", (0.6, 0.6, 0.6), "heights at the start", *PLACE),
    live("lag", 0.005,
        "time constant with which the sliders follow; 0 for none", "s", 0.0, 10.0, told=True),
    # With masses and these, the drives exert forces, and the lag does not count.
    *MASSES,
    *DRIVES,
    live("encoder_resolution", 1e-06, "step of the measured heights; 0 for exact", "m", 0.0, 0.1),
    live("drop_out", 0.0, "fault: fraction of the measurements that is not published", *PART),
    live("frozen_encoders", (False, False, False),
        "fault: the measured heights of these sliders stay as they are"),
    live("encoder_offsets", ZEROS,
        "fault: added to the measured heights; a change of it is a jump", *PLACE),
    live("stuck_sliders", (False, False, False), "fault: these sliders do not move"),
    live("plate_height", 0.0,
        "true height of a plate on the z axis of the base frame; `contact` tells of a touch",
        *PLACE),
    live("plate_tilt", (0.0, 0.0), "by how much the plate rises along x and y", "m/m", -1.0, 1.0),
    live("swing_frequencies", ZEROS,
        "of the platform's modes along x, y and z, 0 for none; three more for a second mode along "
        "each; all of them for each of `swing_points`, one after the other",
        "Hz", 0.0, 500.0, any_size=True),
    live("swing_dampings", (0.03,),
        "of these modes, as part of the critical damping: one for all, or three or six; they are "
        "the same at all points", "", 0.0, 0.5, any_size=True),
    live("swing_shares", (1.0,),
        "of these modes in the swing along their axis: one for all, or three or six; at most 1 "
        "along each axis", *PART, any_size=True),
    live("swing_points", (0.0, 0.0, 0.3),
        "x, y, z of points at which the frequencies are known; with one point, they are the same "
        "everywhere", *PLACE, any_size=True),
    live("encoders_see_swing", False,
        "whether the measured heights are those of the platform that swings; encoders at the "
        "motors do not see that"),
    live("accelerometer_noise", 0.0,
        "standard deviation of `imu/data_raw`, the same in each run", "m/s^2", 0.0, 100.0),
    Parameter("setpoint_period", 0.0,
        "time for which the drives take each setpoint, however late it comes: the machine then "
        "swings as on a computer that is never late; 0 to go to the newest one at once",
        "s", 0.0, 0.1),
    *SYSTEM,
)

CALIBRATION_NODE = (
    *GEOMETRY,
    JOINT_NAMES,
    BASE_FRAME,
    *TRAVEL,
    *WORKSPACE,
    Parameter("folder", ".",
        "of all files that the services name; one that begins with no slash lies below the folder "
        "in which the node was started", told=True),
    Parameter("probe_speed", 0.002,
        "of the platform while it moves down", "m/s", 0.0002, 0.1, told=True),
    Parameter("probe_depth", 0.01, "longest distance down", "m", 1e-4, 1.0, told=True),
    Parameter("contact_timeout", 0.5,
        "a probe ends if nothing is heard of the contact for longer than this; 0 for a switch that "
        "tells of changes only", "s", 0.0, 60.0),
    Parameter("contact_delay", 0.0,
        "mean delay of the message after a contact: debouncing, half a sampling period",
        "s", 0.0, 1.0),
    Parameter("plate_name", "bed", "name of the plate if a request names none"),
    Parameter("plate_known", "height_and_tilt",
        "known values of that plate; the others are fitted, too",
        choices=("height_and_tilt", "tilt", "nothing"), told=True),
    Parameter("plate_height", 0.0, "its height on the z axis of the base frame", *PLACE),
    Parameter("plate_tilt", (0.0, 0.0), "by how much it rises along x and y", "m/m", -1.0, 1.0),
    Parameter("touch_deviation", 1e-5, "standard deviation of a touch", "m", 1e-8, 0.1),
    Parameter("position_deviation", 5e-5,
        "standard deviation of each coordinate of a measured position", "m", 1e-8, 0.1),
    Parameter("distance_deviation", 5e-5, "standard deviation of a distance", "m", 1e-8, 0.1),
    Parameter("use_priors", True,
        "whether the next five parameters say how far the machine may be off"),
    Parameter("prior_anchors", 1e-3,
        "standard deviation of each coordinate of the anchors from the drawn ones", "m", 1e-8, 1.0),
    Parameter("prior_arm_lengths", 5e-4, "standard deviation of each arm length", "m", 1e-8, 1.0),
    Parameter("prior_height_offsets", 2e-3,
        "standard deviation of each height offset", "m", 1e-8, 1.0),
    Parameter("prior_common_radius", 1e-3,
        "standard deviation of a radius that is wrong for all anchors alike", "m", 0.0, 1.0),
    Parameter("prior_common_arm_length", 1e-3,
        "standard deviation of a length that is wrong for all arms alike", "m", 0.0, 1.0),
    Parameter("drawn_machine", (0.0,) * 12,
        "anchors, arm lengths and height offsets that the priors are about, of the drawing; zeros "
        "for the present ones", *PLACE),
    *SYSTEM,
)

# Written into the drives, or what decides what is: so none of it is live.
CIA402_NODE = (
    Parameter("interface", "slcan",
        "kind of CAN adapter, as python-can calls it: `slcan`, `socketcan`, `pcan`, ...",
        told=True),
    Parameter("channel", "/dev/ttyACM0", "of the adapter, as python-can calls it", told=True),
    Parameter("bitrate", 1_000_000, "of the bus", "bit/s", 10_000, 1_000_000, told=True),
    Parameter("node_ids", (1, 2, 3), "number of each slider's drive on the bus", "", 1, 127,
        told=True),
    Parameter("own_node_id", 127, "number of this computer on the bus", "", 1, 127),
    Parameter("rate", 500.0,
        "SYNC messages per second, before each one target for each drive; the period is a whole "
        "number of 0.1 ms", "1/s", 40.0, 1000.0, told=True),
    JOINT_NAMES,
    *TRAVEL,
    replace(LIMITS[0], live=False),
    Parameter("encoder_counts", (1_000_000,) * 3,
        "counts of each drive for `encoder_way`: so no gear is rounded", "", 1, 2**32),
    Parameter("encoder_way", (1_000_000,) * 3,
        "way of each slider for `encoder_counts`", "um", 1, 2**32),
    Parameter("directions", (1, 1, 1),
        "1 where a drive counts up as its slider rises, -1 where it counts down", "", -1, 1),
    Parameter("home_heights", (0.92, 0.92, 0.92),
        "height of each slider where its homing ends, as it is told here", *PLACE),
    Parameter("homing_method", 0,
        "object 0x6098; 0 for the limit switch at the top: 18, or 17 where the direction is -1",
        "", -128, 127),
    Parameter("homing_speed", 0.05, "of all sliders towards their switches", "m/s", 1e-4, 10.0),
    Parameter("homing_slow_speed", 0.005, "of the sliders at their switches", "m/s", 1e-5, 10.0),
    Parameter("homing_acceleration", 0.5, "of the sliders in the homing",
        "m/s^2", 0.001, 1000.0),
    Parameter("homing_timeout", 60.0,
        "all sliders stop if one is not at home after this", "s", 0.1, 3600.0),
    Parameter("playout_delay", 0.01,
        "time by which the drives are behind the setpoints, so that none is late; the same as "
        "`drive_delay` of `ik_node`", "s", 0.0, 0.5, told=True),
    Parameter("heartbeat_timeout", 0.05,
        "each drive stops by itself if it has not heard this computer for longer than this; all "
        "stop if a drive is not heard", "s", 0.004, 60.0, told=True),
    Parameter("quick_stop_deceleration", (10.0, 10.0, 10.0),
        "with which each slider stops where setpoints cease or something is wrong",
        "m/s^2", 0.01, 1000.0),
    Parameter("torque_limits", (0, 0, 0),
        "object 0x6072, thousandths of the rated torque; 0 leaves what is set in the drive",
        "", 0, 65535),
    Parameter("following_error_limits", ZEROS,
        "object 0x6065: a drive is in fault if its slider is farther from its target; 0 leaves "
        "what is set in the drive", "m", 0.0, 10.0),
    Parameter("send_velocities", False,
        "whether drives get velocities for their feed-forward (object 0x60B1), in a second RPDO"),
    *SYSTEM,
)

# Of a belt and a gripper.
CELL = (
    BASE_FRAME,
    Parameter("belt_joint", "belt", "name of the belt in `belt_states`", told=True),
    Parameter("belt_direction", (1.0, 0.0, 0.0),
        "in which the belt runs when its position gets larger; of any length but 0", "",
        -1e6, 1e6, told=True),
    Parameter("belt_resolution", 1e-4, "one step of the belt's encoder", "m", 1e-7, 0.01),
    Parameter("belt_wrap", 0.0,
        "way after which the encoder begins again; 0 for never", "m", 0.0, 1e6),
    Parameter("gripper_point", ZEROS, "of the gripper, from that of the platform", *PLACE),
    Parameter("gripper_output", "gripper",
        "name of the output that closes with 1 and opens with 0"),
    Parameter("gripper_number", 0, "number of that output", "", 0, 1000),
)

PICK_NODE = (
    *GEOMETRY,
    DRIVE_DELAY,
    *CELL,
    Parameter("metres_per_count", 1.0,
        "way of the belt for 1 in `belt_states`: 1 where that tells metres", "m", 1e-9, 10.0,
        told=True),
    Parameter("belt_timeout", 0.1,
        "without a message of the belt for longer than this, no part is picked", "s", 0.01, 10.0),
    Parameter("cameras", ("camera",), "frames of the cameras", any_size=True),
    Parameter("camera_places", ZEROS,
        "of each camera's frame in that of the machine: x, y, z", *PLACE, any_size=True),
    Parameter("camera_turns", ZEROS,
        "of each camera: roll, pitch and yaw about the fixed axes", "rad", -7.0, 7.0,
        any_size=True),
    Parameter("camera_scales", (1.0,), "metres for a unit of each camera", "m", 1e-6, 1e3,
        any_size=True),
    Parameter("camera_latencies", (0.0,),
        "by which the stamps of each camera are late", "s", -1.0, 1.0, any_size=True),
    Parameter("part_spacing", 0.015, "parts are no nearer to each other", "m", 0.001, 10.0),
    Parameter("view_noise", 0.001, "standard deviation of one view of a part", "m", 1e-6, 0.1),
    Parameter("window", (-0.1, 0.1),
        "first and last way along the belt at which a part is gripped", *PLACE, told=True),
    Parameter("closing_time", 0.02, "from the output to the closed gripper", "s", 0.0, 5.0),
    Parameter("opening_time", 0.02, "from the output to the open gripper", "s", 0.0, 5.0),
    Parameter("part_dwell", 0.03,
        "at the part, at the end of which the gripper has closed", "s", 0.0, 10.0),
    Parameter("place_dwell", 0.03,
        "at the place, at the end of which the gripper has opened", "s", 0.0, 10.0),
    Parameter("has_sensor", False, "whether `part_held` tells that the gripper holds a part"),
    Parameter("sensing_time", 0.05,
        "from the closed gripper until `part_held` tells it", "s", 0.0, 5.0),
    Parameter("height", 0.3,
        "of the gripper's point between parts and places", *PLACE, told=True),
    Parameter("tolerance", 0.005,
        "how far the platform may be from the corners of its way", "m", 0.0, 1.0),
    Parameter("allowed_error", 0.001,
        "so far from a part the platform may arrive; else it goes up again", "m", 1e-5, 0.1),
    Parameter("goes_to_wait", False, "whether the platform waits for parts at `waiting_place`"),
    Parameter("waiting_place", (0.0, 0.0, 0.3),
        "of the gripper's point while there is no part", *PLACE),
    Parameter("first_place", (0.0, -0.1, 0.25), "where parts are placed, the first one", *PLACE),
    Parameter("rows", 1, "of places", "", 1, 1000),
    Parameter("columns", 1, "of places in a row", "", 1, 1000),
    Parameter("row_pitch", (0.0, -0.03, 0.0), "from a row to the next", *PLACE),
    Parameter("column_pitch", (0.03, 0.0, 0.0), "from a place to the next in its row", *PLACE),
    Parameter("is_never_full", True,
        "whether a single place takes all parts: a chute, another belt"),
    Parameter("cycle_time", 0.55,
        "at first, of the way from a place to a part, until some were driven", "s", 0.05, 60.0),
    Parameter("taught_file", "",
        "file that keeps what was taught, which takes the place of parameters; empty for "
        "tri_glide_kinematics/taught, of this namespace, in $XDG_STATE_HOME (~/.local/state)"),
    *SYSTEM,
)

SIMULATED_CELL_NODE = (
    *CELL,
    Parameter("belt_speeds", (0.0, 0.1, 1.0),
        "of the belt: when it changes [s], to which speed [m/s], at which acceleration [m/s^2]; "
        "three for each change", "", -1e6, 1e6, any_size=True, told=True),
    Parameter("belt_messages", 100.0, "messages of the belt per second", "1/s", 1.0, 1000.0),
    Parameter("part_count", 200, "of parts", "", 1, 10_000),
    Parameter("first_part", (-0.3, 0.0, 0.25), "where the first part lies at the start", *PLACE),
    Parameter("part_distance", 0.12,
        "mean distance of parts along the belt, which are at random", "m", 0.015, 100.0, told=True),
    Parameter("part_width", 0.06, "of where parts lie at random, across the belt", "m", 0.0, 10.0),
    Parameter("camera", "camera", "frame of the camera, which is that of the machine"),
    Parameter("camera_view", (-0.3, -0.15), "from where to where along the belt it sees", *PLACE),
    Parameter("picture_rate", 30.0, "pictures per second", "1/s", 0.1, 1000.0),
    Parameter("picture_delay", 0.05, "until a picture is told", "s", 0.0, 5.0),
    Parameter("picture_noise", 0.0005,
        "standard deviation of a view of a part, in each of x and y", "m", 0.0, 0.1),
    Parameter("view_faults", ZEROS,
        "fractions of the views that are missing, that have no id, and that have another id",
        *PART),
    Parameter("gripper_delay", 0.02,
        "from the output to the closed or open gripper", "s", 0.0, 5.0),
    Parameter("gripper_reach", 0.003, "how far from its point it takes a part", "m", 0.0, 1.0),
    Parameter("gripper_losses", 0.0, "fraction of the parts that it loses", *PART),
    Parameter("seed", 1, "of all that is at random", "", 0, 2**31 - 1),
    *SYSTEM,
)

PANEL_NODE = (
    Parameter("host", "127.0.0.1",
        "address on which the page is served; any but a loopback one lets others drive, if they "
        "know the token", told=True),
    Parameter("port", 8080, "port on which the page is served; 0 for any", "", 0, 65535, told=True),
    Parameter("points_file", "",
        "file in which taught points are saved, for `drive`; empty for taught_points.yaml here"),
    Parameter("token_file", "",
        "file that keeps the token in the address of the page, made if there is none; empty for "
        "tri_glide_kinematics/panel_token in $XDG_STATE_HOME (~/.local/state)"),
    Parameter("programs_folder", "",
        "folder of the programs that pages upload, made with the first one; empty for "
        "tri_glide_kinematics/programs in $XDG_STATE_HOME (~/.local/state)"),
    Parameter("program_settings", "",
        "file with what programs do not say: dialect, offsets, tools and places; empty for the one "
        "that `drive` takes, config/program_settings.yaml"),
    Parameter("progress_file", "",
        "file that keeps how far a program came; empty for the one that `drive` keeps for this "
        "namespace"),
    Parameter("work_zero_file", "",
        "file that keeps the work zeros; empty for the one that `drive` takes for this namespace"),
    Parameter("measurements_file", "",
        "measurements of a calibration, whose uncertainty the page shows as a map; empty for none"),
    Parameter("notice_file", "",
        "file whose text the page shows beside the state, as `panel` writes it; empty for none"),
    Parameter("start_again_file", "",
        "file that the page makes to have nodes that have ended started again; empty for none"),
    *SYSTEM,
)

# fmt: on
NODES = {
    "ik_node": IK_NODE,
    "fk_node": FK_NODE,
    "simulator_node": SIMULATOR_NODE,
    "cia402_node": CIA402_NODE,
    "calibration_node": CALIBRATION_NODE,
    "pick_node": PICK_NODE,
    "simulated_cell_node": SIMULATED_CELL_NODE,
    "panel_node": PANEL_NODE,
}


INTRODUCTION = """# Parameters

`config/tri_glide.yaml` holds those of the default machine; a parameter that a file does not name
has the default of these tables. *Live* ones may be changed while the machine moves
(`ros2 param set`). A new value is refused, with the reason, if it does not fit its bounds or the
other parameters. A node does not start with a file in which a key stands twice: ROS would take
one of them without a word.

ROS declares `use_sim_time` for each node. With `true`, stamps are those of `/clock`, and 0 where
nobody publishes it. The motion goes by the steady clock of this computer all the same, so leave it
`false` for a machine.

This page is made by `python -m tri_glide_kinematics.settings.tables > docs/parameters.md`."""


def document() -> str:
    """Return the parameters of all nodes as a page in Markdown. Each row stands once."""
    parts = [INTRODUCTION]
    told: dict[str, list[Parameter]] = {}
    for name, table in NODES.items():
        if table is SIMULATED_CELL_NODE:
            parts.append(f"`{name} --help` prints those of a simulated belt, camera and gripper.")
            continue
        own = list(table)
        parts.append(f"## `{name}`")
        for node, rows in told.items():
            if same := [f"`{each.name}`" for each in own if each in rows]:
                parts.append(f"As for `{node}`: {', '.join(same)}.")
                own = [each for each in own if each not in rows]
        if own:
            parts.append(markdown_table(own))
        told[name] = own
    return "\n\n".join(parts)


if __name__ == "__main__":
    print(document())
