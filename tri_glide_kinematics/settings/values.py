"""Makes geometry, limits and bounds from the values of parameters. No ROS in here."""

from __future__ import annotations

from tri_glide_kinematics.control import InPositionBounds, SupervisionBounds
from tri_glide_kinematics.description import MachineDescription, Parts
from tri_glide_kinematics.drives import DriveSettings, DriveUnits, GroupSettings
from tri_glide_kinematics.dynamics import Arm, Masses, SliderForces
from tri_glide_kinematics.motion.limits import (
    AddedBound,
    ForceLimits,
    PlatformSpeedLimit,
    SliderLimits,
)
from tri_glide_kinematics.motion.shaping import (
    LOWEST_FREQUENCY,
    MOST_MODES,
    Mode,
    Shaper,
    ShaperByPlace,
    ShaperKind,
    Shaping,
)
from tri_glide_kinematics.settings.tables import (
    DRIVES,
    FORCE_LIMITS,
    MASSES,
    MOST_FORCE,
    NO_SHAPER,
    Parameter,
    ParameterError,
    Values,
)
from tri_glide_kinematics.simulation import PlatformMode, PositionControl, SwingModel
from tri_glide_kinematics.tri_glide import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import Vector3, plus
from tri_glide_kinematics.wording import refused_text
from tri_glide_kinematics.workspace import Cylinder, Workspace, WorkspaceLimits

CALIBRATED = "calibrated"

# Modes that are told: one along each axis, or two.
MODE_COUNTS = (3, 6)


def machine_of(values: Values) -> TriGlide:
    """Return the machine that the geometry parameters describe.

    Raises:
        KinematicsError: if no working machine has this geometry.
    """
    if values["geometry"] == CALIBRATED:
        numbers = values["anchors"]
        geometry = TriGlideGeometry(
            (numbers[0:2], numbers[2:4], numbers[4:6]), values["arm_lengths"]
        )
    else:
        geometry = TriGlideGeometry.symmetric(
            values["base_radius"],
            values["platform_radius"],
            values["arm_length"],
            values["orientation"],
        )
    return TriGlide(geometry)


def description_of(values: Values, rod_distance: float | None = None) -> MachineDescription:
    """Return all that other programs are told about the machine, by the values of ``ik_node``.

    Args:
        values: of its parameters.
        rod_distance: of the two rods of an arm; None for one that looks well [m].

    Raises:
        KinematicsError: if no working machine has this geometry, or names or heights do not fit.
    """
    check_joint_names(values)
    check_travel(values)
    machine = machine_of(values)
    up, down = values["force_limit_up"], values["force_limit_down"]
    first, second, third = (max(pair) or MOST_FORCE for pair in zip(up, down))
    return MachineDescription(
        machine,
        Parts.of(machine.geometry, values["platform_radius"], rod_distance),
        values["joint_names"],
        values["base_frame"],
        values["platform_frame"],
        values["lower_heights"],
        values["upper_heights"],
        values["height_offsets"],
        limits_of(values).velocity,
        (first, second, third),
    )


def limits_of(values: Values) -> SliderLimits:
    """Return the limits of the drives.

    Raises:
        KinematicsError: if a limit is not a positive number.
    """
    return SliderLimits(
        values["velocity_limits"], values["acceleration_limits"], values["jerk_limits"]
    )


def motion_limits_of(
    values: Values, machine: TriGlide, forces: SliderForces | None = None
) -> SliderLimits:
    """Return the limits of the drives, with what bounds all motion of a ``machine`` besides.

    Its ``forces`` are made if they are not given.

    Raises:
        ParameterError: if there is a force limit without masses.
        KinematicsError: as for ``limits_of`` and ``forces_of``.
    """
    added: list[AddedBound] = []
    speed = values["platform_speed_limit"]
    if speed:
        added.append(PlatformSpeedLimit(machine, speed))
    limited = [entry for entry in FORCE_LIMITS if any(values[entry.name])]
    forces = forces or forces_of(values, machine)
    if limited:
        if forces is None:
            raise _without_masses(limited[0], values)
        (u1, u2, u3), (d1, d2, d3) = (
            [limit or MOST_FORCE for limit in values[entry.name]] for entry in FORCE_LIMITS
        )
        added.append(ForceLimits(forces, (u1, u2, u3), (d1, d2, d3)))
    return limits_of(values).with_added(*added)


def scaled_limits_of(values: Values, machine: TriGlide) -> SliderLimits:
    """Return what bounds all motion of a ``machine`` that has the ``speed_scale`` of the values.

    Raises:
        KinematicsError: as for ``motion_limits_of``.
    """
    return motion_limits_of(values, machine).with_velocity_scaled(values["speed_scale"])


def position_control_of(values: Values, forces: SliderForces | None) -> PositionControl | None:
    """Return how simulated drives hold their setpoints with forces; None if they exert none.

    Raises:
        ParameterError: if there are no masses, though the drives have a stiffness.
        KinematicsError: if only some of the numbers are greater than zero.
    """
    given = [entry for entry in DRIVES if any(values[entry.name])]
    if not given:
        return None
    if forces is None:
        raise _without_masses(given[0], values)
    return PositionControl(values["drive_stiffness"], values["drive_damping"])


def _without_masses(entry: Parameter, values: Values) -> ParameterError:
    """Return the error of a parameter that is given, and needs masses that are not."""
    return ParameterError(
        f"{entry.name} = {entry.text(values[entry.name])} needs masses: set at least "
        "carriage_masses and platform_mass"
    )


def forces_of(values: Values, machine: TriGlide) -> SliderForces | None:
    """Return the forces of a ``machine`` with the masses that are given; None without masses.

    Raises:
        ParameterError: if some masses are given, and others are missing.
        KinematicsError: if the masses do not fit together.
    """
    given = [entry for entry in MASSES if values[entry.name] != entry.default]
    if not given:
        return None
    for index, mass in enumerate((*values["carriage_masses"], values["platform_mass"])):
        if not mass:
            name = f"carriage_masses[{index}]" if index < 3 else "platform_mass"
            entry = given[0]
            raise ParameterError(
                f"{name} = 0 kg must be greater than 0 kg, as {entry.name} = "
                f"{entry.text(values[entry.name])} is given"
            )
    arms = zip(values["arm_masses"], values["arm_centres"], values["arm_inertias"])
    first, second, third = (Arm(mass, centre, inertia or None) for mass, centre, inertia in arms)
    masses = Masses(
        values["carriage_masses"],
        (first, second, third),
        values["platform_mass"],
        values["payload"],
        counterweights=values["counterweight_masses"],
        coulomb=values["coulomb_friction"],
        viscous=values["viscous_friction"],
        gravity=values["gravity"],
    )
    return SliderForces(machine, masses)


def shaper_of(values: Values) -> Shaping | None:
    """Return the shaper, or what chooses one by place; None if there is none.

    Raises:
        ParameterError: if the numbers of places, frequencies and dampings do not fit.
        KinematicsError: if there are too many places, or two of them are the same.
    """
    places, frequencies = _places("mode_places", values), values["mode_frequencies"]
    size, rest = divmod(len(frequencies), len(places))
    if rest or not 1 <= size <= MOST_MODES:
        for_each = "" if len(places) == 1 else f" for each of {len(places)} places"
        raise ParameterError(
            f"mode_frequencies has {len(frequencies)} elements, expected 1 to {MOST_MODES}"
            f"{for_each}"
        )
    dampings = _for_each_mode("mode_dampings", values, len(frequencies))
    modes = [Mode(frequency, damping) for frequency, damping in zip(frequencies, dampings)]
    of_places = tuple(tuple(modes[i : i + size]) for i in range(0, len(modes), size))
    # Places are checked without a shaper, too.
    kind = ShaperKind.ZV if values["shaper"] == NO_SHAPER else ShaperKind(values["shaper"])
    by_place = ShaperByPlace(kind, places, of_places)
    if values["shaper"] == NO_SHAPER:
        return None
    return by_place if len(places) > 1 else Shaper.of(kind, *modes)


def true_travel_of(values: Values) -> tuple[Vector3, Vector3]:
    """Return the true heights of the lower and of the upper ends of travel, each (3,) [m]."""
    offsets = values["height_offsets"]
    return plus(values["lower_heights"], offsets), plus(values["upper_heights"], offsets)


def workspace_limits_of(values: Values) -> WorkspaceLimits:
    """Return where the platform and the sliders may be, in true heights.

    Raises:
        KinematicsError: if two bounds are not in order.
    """
    space = values["space"]
    box_lower, box_upper, cylinder = None, None, None
    if space == "box":
        box_lower, box_upper = values["box_lower"], values["box_upper"]
    elif space == "cylinder":
        center_x, center_y = values["cylinder_center"]
        z_min, z_max = values["cylinder_z"]
        cylinder = Cylinder(center_x, center_y, values["cylinder_radius"], z_min, z_max)
    return WorkspaceLimits(
        *true_travel_of(values),
        values["reach_margin"],
        values["max_condition_number"],
        box_lower,
        box_upper,
        cylinder,
    )


def workspace_of(values: Values) -> Workspace:
    """Return where the platform of the machine may be.

    Raises:
        KinematicsError: as for ``machine_of`` and ``workspace_limits_of``.
    """
    return Workspace(machine_of(values), workspace_limits_of(values))


def supervision_bounds_of(values: Values) -> SupervisionBounds:
    """Return how far the measured heights may differ from what is expected."""
    return SupervisionBounds(
        values["measured_timeout"],
        values["jump_limit"],
        values["tracking_error_limit"],
        values["velocity_limits"],
    )


def in_position_bounds_of(values: Values) -> InPositionBounds:
    """Return when a target counts as reached.

    Raises:
        ParameterError: if the two distances, or the two times, are not in order.
    """
    names = ("position_tolerance", "settling_time", "settling_timeout", "position_error_limit")
    tolerance, settling_time, timeout, error_limit = (values[name] for name in names)
    if not tolerance <= error_limit:
        raise ParameterError(
            f"position_tolerance = {tolerance:g} m must be at most position_error_limit = "
            f"{error_limit:g} m"
        )
    if not settling_time <= timeout:
        raise ParameterError(
            f"settling_time = {settling_time:g} s must be at most settling_timeout = {timeout:g} s"
        )
    return InPositionBounds(tolerance, settling_time, timeout, error_limit)


def swing_of(values: Values) -> SwingModel:
    """Return how the platform of a simulated machine swings.

    Raises:
        KinematicsError: if the numbers do not fit together.
    """
    numbers, points = values["swing_frequencies"], _places("swing_points", values)
    size, rest = divmod(len(numbers), len(points))
    if rest or size not in MODE_COUNTS:
        raise ParameterError(
            f"swing_frequencies has {len(numbers)} elements, expected 3 or 6 for each of "
            f"{len(points)} points"
        )
    dampings = _for_each_mode("swing_dampings", values, size)
    shares = _for_each_mode("swing_shares", values, size)
    modes = []
    for index in range(size):
        frequencies = numbers[index::size]
        if any(frequencies):
            for point, frequency in enumerate(frequencies):
                if frequency < LOWEST_FREQUENCY:
                    raise ParameterError(
                        f"swing_frequencies[{size * point + index}] = {refused_text(frequency)} Hz "
                        f"must be at least {LOWEST_FREQUENCY:g} Hz, or 0 at each of the points"
                    )
            modes.append(PlatformMode(index % 3, frequencies, dampings[index], shares[index]))
    return SwingModel(tuple(modes), points)


def drive_group_settings_of(values: Values) -> GroupSettings:
    """Return what three drives on a bus are led with.

    Raises:
        KinematicsError: if the numbers do not fit together.
    """
    check_joint_names(values)
    check_travel(values)
    first, second, third = (_drive_settings_of(values, axis) for axis in range(3))
    return GroupSettings(
        (first, second, third),
        period=1.0 / values["rate"],
        bitrate=values["bitrate"],
        playout_delay=values["playout_delay"],
        own_node=values["own_node_id"],
        consumer_time=values["heartbeat_timeout"],
        sends_velocity=values["send_velocities"],
        homing_speed=values["homing_speed"],
        homing_slow_speed=values["homing_slow_speed"],
        homing_acceleration=values["homing_acceleration"],
        homing_timeout=values["homing_timeout"],
    )


def _drive_settings_of(values: Values, axis: int) -> DriveSettings:
    counts, way = values["encoder_counts"][axis], values["encoder_way"][axis]
    return DriveSettings(
        values["node_ids"][axis],
        DriveUnits(counts, way, values["directions"][axis]),
        values["home_heights"][axis],
        values["lower_heights"][axis],
        values["upper_heights"][axis],
        values["velocity_limits"][axis],
        values["quick_stop_deceleration"][axis],
        # Zeros are for what the drive has.
        values["torque_limits"][axis] or None,
        values["following_error_limits"][axis] or None,
        values["homing_method"] or None,
    )


def _places(name: str, values: Values) -> tuple[Vector3, ...]:
    """Return the places that a parameter has the coordinates of, one after the other.

    Raises:
        ParameterError: if there are not three numbers for each.
    """
    coordinates: tuple[float, ...] = values[name]
    if len(coordinates) % 3:
        raise ParameterError(
            f"{name} has {len(coordinates)} elements, expected three for each place"
        )
    return tuple(zip(coordinates[0::3], coordinates[1::3], coordinates[2::3]))


def _for_each_mode(name: str, values: Values, size: int) -> tuple[float, ...]:
    """Return the numbers of a parameter, one for each of ``size`` modes.

    Raises:
        ParameterError: if it has neither one number nor so many.
    """
    numbers: tuple[float, ...] = values[name]
    if len(numbers) == 1:
        return numbers * size
    if len(numbers) != size:
        expected = "1" if size == 1 else f"1 or {size}"
        raise ParameterError(f"{name} has {len(numbers)} elements, expected {expected}")
    return numbers


def check_travel(values: Values) -> None:
    """Check that each slider has somewhere to go.

    Raises:
        ParameterError: if the ends of its travel are not in order.
    """
    pairs = zip(values["lower_heights"], values["upper_heights"])
    for index, (lower, upper) in enumerate(pairs):
        if not lower < upper:
            raise ParameterError(
                f"lower_heights[{index}] = {refused_text(lower)} m must be less than "
                f"upper_heights[{index}] = {refused_text(upper)} m"
            )


def check_joint_names(values: Values) -> None:
    """Check that the three sliders can be told apart.

    Raises:
        ParameterError: if a name is empty or given twice.
    """
    names = values["joint_names"]
    if "" in names or len(set(names)) != len(names):
        raise ParameterError(f"joint_names = {list(names)} must be three different names")
