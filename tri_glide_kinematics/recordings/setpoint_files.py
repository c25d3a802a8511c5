"""Motions of the sliders in files: tables (CSV), and recordings of ROS 2 in the format MCAP.

MCAP needs the Python package ``mcap-ros2-support``, and no ROS. Heights in files are those that the
drives are told: true heights less the parameter ``height_offsets``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import write_file
from tri_glide_kinematics.keys import FileError
from tri_glide_kinematics.motion.limits import SampledPlan
from tri_glide_kinematics.tables import TableError, read_table
from tri_glide_kinematics.vectors import FloatArray

TOPIC = "joint_commands"
TABLE_ENDING = ".csv"
MCAP_ENDING = ".mcap"

SLIDERS = (1, 2, 3)
COLUMNS = (
    ("time", "s"),
    *((f"height_{slider}", "m") for slider in SLIDERS),
    *((f"velocity_{slider}", "m/s") for slider in SLIDERS),
    *((f"acceleration_{slider}", "m/s^2") for slider in SLIDERS),
    *((axis, "m") for axis in "xyz"),
)
MEASURED = tuple((f"measured_{slider}", "m") for slider in SLIDERS)

# Numbers that end in zeros may be written without them: heights have so many digits at least [m].
COARSEST = 1e-6

# Forces of the sliders that a recording does not have [N].
NO_FORCES = (np.nan,) * 3

NANOSECONDS = 1_000_000_000  # in a second

MESSAGE = "sensor_msgs/msg/JointState"
_SEPARATOR = "=" * 80
DEFINITION = f"""\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


class RecordingError(FileError):
    """A recording cannot be read or written, or has no setpoints."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Setpoints as they were published, or measurements, in the order in which they came.

    Attributes:
        stamps: since the first one. Shape (n,) [s].
        heights: as the drives are told. Shape (n, 3) [m].
        velocities: None if none were recorded. Shape (n, 3) [m/s].
        efforts: forces of the drives, NaN where a message has none; None if none were recorded.
            Shape (n, 3) [N].
        resolution: a half of the last digit of the heights; 0 for numbers in double precision [m].
        measured: heights as the drives tell them, beside setpoints; None if none were recorded.
            Shape (n, 3) [m].
    """

    stamps: FloatArray
    heights: FloatArray
    velocities: FloatArray | None
    resolution: float = 0.0
    efforts: FloatArray | None = None
    measured: FloatArray | None = None


def save_csv(file: Path, setpoints: SampledPlan, positions: FloatArray) -> None:
    """Write setpoints as a table; the numbers have all their digits.

    Args:
        file: where; what is there is replaced.
        setpoints: with heights as the drives are told.
        positions: of the platform. Shape (n, 3) [m].

    Raises:
        RecordingError: if it cannot be written.
    """
    rows = np.column_stack((*setpoints[:4], positions))
    head = ",".join(f"{name} [{unit}]" for name, unit in COLUMNS)
    lines = [head, *(",".join(map(repr, row)) for row in rows.tolist())]
    _write(file, "\n".join(lines) + "\n")


def save_mcap(file: Path, setpoints: SampledPlan, joints: Sequence[str], frame: str) -> None:
    """Write setpoints as ``ik_node`` publishes them on ``joint_commands``; stamps begin at zero.

    Args:
        file: where; what is there is replaced.
        setpoints: with heights as the drives are told.
        joints: names of the sliders. Shape (3,).
        frame: that the messages name.

    Raises:
        RecordingError: if it cannot be written, or ``mcap-ros2-support`` is missing.
    """
    try:
        from mcap_ros2.writer import Writer
    except ModuleNotFoundError as error:
        raise _missing(file) from error
    content = BytesIO()
    writer = Writer(content)
    schema = writer.register_msgdef(MESSAGE, DEFINITION)
    columns = (setpoints.times, setpoints.heights, setpoints.velocities)
    for number, (time, heights, velocities) in enumerate(zip(*(each.tolist() for each in columns))):
        stamp = round(time * NANOSECONDS)
        seconds, rest = divmod(stamp, NANOSECONDS)
        header = {"stamp": {"sec": seconds, "nanosec": rest}, "frame_id": frame}
        message = {
            "header": header,
            "name": list(joints),
            "position": heights,
            "velocity": velocities,
            "effort": [],
        }
        writer.write_message(f"/{TOPIC}", schema, message, stamp, stamp, number)
    writer.finish()
    _write(file, content.getvalue())


def load_recording(file: str | Path, joints: Sequence[str], topic: str = TOPIC) -> Recording:
    """Read setpoints, or measurements.

    Args:
        file: a table as ``save_csv`` writes it, of which the time and the heights are needed; an
            MCAP file; or a folder that ``ros2 bag record`` has made, with MCAP files in it.
        joints: names of the sliders in the messages. Shape (3,).
        topic: of the messages, in any namespace.

    Raises:
        RecordingError: if it cannot be read, has no setpoints, or has those of several machines.
        TableError: if a cell of a table is no number.
    """
    path = Path(file)
    if path.is_dir():
        files = sorted(path.glob(f"*{MCAP_ENDING}"), key=lambda part: (len(part.name), part.name))
        if not files:
            reason = f"has no file that ends in {MCAP_ENDING}; other recordings are not read"
            raise RecordingError(file, "", reason)
        return _of_messages(file, files, joints, topic)
    if path.suffix.lower() == TABLE_ENDING:
        return _of_table(file)
    if path.suffix.lower() == MCAP_ENDING:
        return _of_messages(file, [path], joints, topic)
    reason = f"is no recording: a folder, or a file that ends in {MCAP_ENDING} or {TABLE_ENDING}"
    raise RecordingError(file, "", reason)


def _of_table(file: str | Path) -> Recording:
    table = read_table(file, may_be_endless=True)
    if table.heads is None:
        head = ", ".join(f"{name} [{unit}]" for name, unit in COLUMNS[:7])
        raise RecordingError(file, "line 1", f"has no head; it must have the columns {head}")
    columns = {head.name: column for column, head in enumerate(table.heads)}
    units = {**dict(COLUMNS + MEASURED), **{f"effort_{slider}": "N" for slider in SLIDERS}}
    for each in table.heads:
        if each.name in units and each.unit not in (None, units[each.name]):
            reason = f"{each.name} is in {each.unit}, must be in {units[each.name]}"
            raise TableError(file, table.head_line, columns[each.name] + 1, reason)

    def found(quantity: str) -> FloatArray | None:
        names = [f"{quantity}_{slider}" for slider in SLIDERS]
        missing = [name for name in names if name not in columns]
        if missing and len(missing) < len(names):
            raise TableError(file, table.head_line, 0, f"has no column {missing[0]}")
        return None if missing else table.numbers[:, [columns[name] for name in names]]

    heights = found("height")
    if heights is None or "time" not in columns:
        missing = "time" if heights is not None else "height_1"
        raise TableError(file, table.head_line, 0, f"has no column {missing}")
    stamps = table.numbers[:, columns["time"]]
    return Recording(
        stamps - stamps[np.isfinite(stamps)][:1].sum(),
        heights,
        found("velocity"),
        0.5 * min(float(table.steps[columns["height_1"]].min()), COARSEST),
        found("effort"),
        found("measured"),
    )


def _of_messages(
    file: str | Path, files: Sequence[Path], joints: Sequence[str], topic: str
) -> Recording:
    wanted = topic.strip("/")
    stamps: list[int] = []
    rows: list[tuple[float, ...]] = []
    rates: list[tuple[float, ...]] = []
    forces: list[tuple[float, ...]] = []
    topics: set[str] = set()
    others: set[str] = set()
    for part in files:
        for name, message in _messages(part, others):
            if not f"/{name.strip('/')}".endswith(f"/{wanted}"):
                others.add(name)
                continue
            topics.add(name)
            if len(topics) > 1:
                reason = f"has {' and '.join(sorted(topics))}: name one of them with --topic"
                raise RecordingError(file, "", reason)
            place = f"message {len(stamps) + 1} of {name}"
            names = list(message.name)
            missing = [joint for joint in joints if joint not in names]
            if missing:
                reason = f"has no joint {missing[0]}, but {', '.join(names) or 'none'}"
                raise RecordingError(file, place, reason)
            order = [names.index(joint) for joint in joints]
            heights, velocities, efforts = message.position, message.velocity, message.effort
            sizes = (len(heights), len(velocities), len(efforts))
            if sizes[0] != len(names) or not {*sizes[1:]} <= {0, len(names)}:
                counts = "{} positions, {} velocities and {} efforts".format(*sizes)
                raise RecordingError(file, place, f"has {counts} of {len(names)} joints")
            stamp = message.header.stamp
            stamps.append(stamp.sec * NANOSECONDS + stamp.nanosec)
            rows.append(tuple(heights[joint] for joint in order))
            rates.append(tuple(velocities[joint] for joint in order) if len(velocities) else ())
            # Setpoints have them from when the masses are known.
            forces.append(tuple(efforts[joint] for joint in order) if len(efforts) else NO_FORCES)
    if not stamps:
        told = f"; it has {', '.join(sorted(others))}" if others else ""
        raise RecordingError(file, "", f"has no messages of {wanted}{told}")
    if len({len(row) for row in rates}) > 1:
        raise RecordingError(file, "", "has messages with velocities and others without")
    # Differences of whole nanoseconds: the seconds since 1970 would take the digits.
    times: NDArray[np.int64] = np.array(stamps, dtype=np.int64) - stamps[0]
    table = np.array(forces)
    return Recording(
        times / NANOSECONDS,
        np.array(rows),
        np.array(rates) if rates[0] else None,
        efforts=None if np.isnan(table).all() else table,
    )


def _messages(file: Path, others: set[str]) -> Iterator[tuple[str, Any]]:
    """Yield the topic and content of all joint states, in the order in which they were recorded.

    The topics of all other messages are added to ``others``.
    """
    try:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory
    except ModuleNotFoundError as error:
        raise _missing(file) from error
    factory = DecoderFactory()
    decoders: dict[int, Any] = {}
    try:
        with file.open("rb") as stream:
            reader = make_reader(stream)
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                if schema is None or schema.name != MESSAGE:
                    others.add(channel.topic)
                    continue
                if schema.id not in decoders:
                    decoders[schema.id] = factory.decoder_for(channel.message_encoding, schema)
                yield channel.topic, decoders[schema.id](message.data)
    except OSError as error:
        raise RecordingError(file, "", f"cannot be read: {error.strerror or error}") from error
    except Exception as error:
        # Of a damaged file the library raises whatever its bytes make of it.
        reason = f"cannot be read as MCAP: {error or type(error).__name__}"
        raise RecordingError(file, "", reason) from error


def _missing(file: str | Path) -> KinematicsError:
    reason = "MCAP needs a Python package: python3 -m pip install mcap-ros2-support"
    return RecordingError(file, "", reason)


def _write(file: Path, content: str | bytes) -> None:
    with RecordingError.of_writing(file):
        write_file(file, content)
