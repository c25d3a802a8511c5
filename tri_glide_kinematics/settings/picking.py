"""Makes what picks parts from the values of parameters, and of what was taught. No ROS in here."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import file_of_machine, replace_file
from tri_glide_kinematics.picking import (
    BeltMotion,
    Parts,
    Picker,
    PickOrder,
    PickSettings,
    Places,
    Readings,
    SimulatedBelt,
    SimulatedCamera,
    SimulatedEncoder,
    SimulatedGripper,
    TaughtBelt,
    TaughtCamera,
    TaughtCell,
    WayTimes,
    grid,
    laid_parts,
)
from tri_glide_kinematics.settings.tables import PICK_NODE, ParameterError, Values
from tri_glide_kinematics.vectors import Vector3, minus, scaled

# What of the parameters is taught.
TAUGHT = ("belt_direction", "metres_per_count", "gripper_point")

# Of each camera so many numbers, in the order of ``TaughtCamera``.
TAUGHT_OF_CAMERAS = {
    "camera_places": 3,
    "camera_turns": 3,
    "camera_scales": 1,
    "camera_latencies": 1,
}

# So late does a simulated encoder tell its position [s].
ENCODER_DELAY = 0.002


def cameras_of(values: Values) -> dict[str, TaughtCamera]:
    """Return the cameras by their frames.

    Raises:
        ParameterError: if a name stands twice, or there are not as many numbers as cameras need.
    """
    names = values["cameras"]
    if len(set(names)) < len(names):
        raise ParameterError(f"cameras = ({', '.join(names)}) must have each name once")
    for name, each in TAUGHT_OF_CAMERAS.items():
        if len(values[name]) != each * len(names):
            raise ParameterError(
                f"{name} has {len(values[name])} elements, expected {each * len(names)}: "
                f"{each} for each of cameras"
            )
    return {
        name: TaughtCamera(
            values["camera_places"][3 * index : 3 * index + 3],
            values["camera_turns"][3 * index : 3 * index + 3],
            values["camera_scales"][index],
            values["camera_latencies"][index],
        )
        for index, name in enumerate(names)
    }


def direction_of(values: Values) -> Vector3:
    """Return the unit vector along which the belt runs.

    Raises:
        ParameterError: if it has no length.
    """
    direction = values["belt_direction"]
    length = math.hypot(*direction)
    if not length > 0.0:
        raise ParameterError("belt_direction = (0, 0, 0) must have a length above 0")
    return scaled(direction, 1.0 / length)


def taught_of(values: Values) -> TaughtCell:
    """Return what is taught.

    Raises:
        ParameterError: if there are not as many numbers as cameras need.
    """
    belt = TaughtBelt(direction_of(values), values["metres_per_count"], 0.0)
    return TaughtCell(values["gripper_point"], belt, cameras_of(values))


def taught_values(cell: TaughtCell) -> dict[str, Any]:
    """Return what is taught, by the names of parameters.

    Raises:
        KinematicsError: if a value is outside the bounds of its parameter.
    """
    belt, cameras = cell.belt, cell.cameras.values()
    taught = (belt.direction, belt.metres_per_count, cell.point)
    of_cameras = (
        [number for camera in cameras for number in camera.position],
        [number for camera in cameras for number in camera.roll_pitch_yaw],
        [camera.scale for camera in cameras],
        [camera.latency for camera in cameras],
    )
    return checked(dict(zip((*TAUGHT, *TAUGHT_OF_CAMERAS), (*taught, *of_cameras))))


def picker_of(values: Values) -> Picker:
    """Return what picks.

    Raises:
        KinematicsError: if parameters do not fit together.
    """
    first, last = values["window"]
    if not first < last:
        raise ParameterError(f"window = ({first:g}, {last:g}) m must ascend")
    for time, dwell in (("closing_time", "part_dwell"), ("opening_time", "place_dwell")):
        if values[time] > values[dwell]:
            raise ParameterError(
                f"{time} = {values[time]:g} s must be at most {dwell}, {values[dwell]:g} s"
            )
    direction, point = direction_of(values), values["gripper_point"]
    belt = BeltMotion(values["belt_resolution"], values["belt_wrap"], values["belt_timeout"])
    parts = Parts(direction, values["part_spacing"], values["view_noise"])
    pitches = values["row_pitch"], values["column_pitch"]
    positions = grid(values["first_place"], (values["rows"], values["columns"]), pitches)
    waiting = minus(values["waiting_place"], point) if values["goes_to_wait"] else None
    settings = PickSettings(
        values["height"] - point[2],
        values["tolerance"],
        waiting,
        point,
        values["closing_time"],
        values["opening_time"],
        (values["part_dwell"], values["place_dwell"]),
        values["sensing_time"],
        values["allowed_error"],
    )
    times = WayTimes(values["first_place"], values["cycle_time"], settings.dwells)
    is_fixed = values["is_never_full"] and len(positions) == 1
    order = PickOrder(direction, (first, last), times)
    return Picker(belt, parts, order, Places(positions, is_fixed=is_fixed), settings, times.note)


def taught_file_of(values: Values, namespace: str) -> Path:
    """Return the file that keeps what was taught."""
    return Path(values["taught_file"] or file_of_machine("taught", namespace))


def checked(taught: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is ``taught``, by the names of parameters.

    Raises:
        KinematicsError: if a value is outside the bounds of its parameter.
    """
    table = {each.name: each for each in PICK_NODE}
    return {name: table[name].checked(value) for name, value in taught.items()}


def taught_in(file: Path) -> dict[str, Any]:
    """Return the parameters that a file keeps, none without the file.

    Raises:
        ParameterError: if the file cannot be read, holds something else, or a value that is not
            within the bounds of its parameter.
    """
    names = {*TAUGHT, *TAUGHT_OF_CAMERAS}
    try:
        kept = yaml.safe_load(file.read_text()) if file.exists() else {}
        if not isinstance(kept, dict):
            raise ParameterError("it holds no names with their values")
        return checked({name: value for name, value in kept.items() if name in names})
    except (OSError, ValueError, yaml.YAMLError, KinematicsError) as error:
        raise ParameterError(f"taught_file {file} cannot be used: {error}") from error


def keep_taught(values: Values, file: Path) -> None:
    """Write what is taught of ``values`` to a ``file``."""
    kept: dict[str, Any] = {}
    for name in (*TAUGHT, *TAUGHT_OF_CAMERAS):
        value = values[name]
        kept[name] = list(value) if isinstance(value, Sequence) else value
    file.parent.mkdir(parents=True, exist_ok=True)
    replace_file(file, f"# What pick_node was taught.\n{yaml.safe_dump(kept)}")


def simulated_cell_of(
    values: Values,
) -> tuple[SimulatedEncoder, SimulatedCamera, SimulatedGripper]:
    """Return what stands in for a belt with its encoder, a camera and a gripper.

    Raises:
        ParameterError: if parameters do not fit together.
    """
    numbers, direction = values["belt_speeds"], direction_of(values)
    changes = sorted(zip(numbers[::3], numbers[1::3], numbers[2::3]))
    if len(numbers) % 3 or any(acceleration <= 0.0 for *_, acceleration in changes):
        raise ParameterError(
            f"belt_speeds = {numbers} must be three numbers for each change, with accelerations "
            "above 0"
        )
    belt, seed = SimulatedBelt(direction, 0.0, changes), values["seed"]
    parts = laid_parts(
        belt,
        values["part_count"],
        values["part_distance"],
        first=values["first_part"],
        width=values["part_width"],
        at_random=True,
        seed=seed,
    )
    step, reports = values["belt_resolution"], Readings(values["belt_messages"], ENCODER_DELAY)
    pictures = Readings(values["picture_rate"], values["picture_delay"], seed=seed)
    return (
        SimulatedEncoder(belt, reports, step, round(values["belt_wrap"] / step)),
        SimulatedCamera(
            values["camera"],
            belt,
            parts,
            values["camera_view"],
            pictures,
            values["picture_noise"],
            *values["view_faults"],
        ),
        SimulatedGripper(
            belt,
            parts,
            values["gripper_delay"],
            reach=values["gripper_reach"],
            losing=values["gripper_losses"],
            random=random.Random(seed),
        ),
    )
