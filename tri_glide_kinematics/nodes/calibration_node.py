"""Notes measurements of the machine, probes a plate, fits the geometry, and finds the modes."""

from __future__ import annotations

import math
import time
from collections.abc import Awaitable, Callable, Generator
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from tri_glide_interfaces.srv import (
    DropMeasurement,
    FindModes,
    ListMeasurements,
    LoadMeasurements,
    ProbePlate,
    RecordDistanceEnd,
    RecordPosition,
    RecordTouch,
    SaveMeasurements,
    SolveCalibration,
)
from tri_glide_kinematics.calibration.fit import (
    MachineParameters,
    MeasurementFile,
    Plate,
    Priors,
    load_measurements,
    save_measurements,
)
from tri_glide_kinematics.calibration.session import (
    LeadingError,
    ProbeSettings,
    SavingError,
    Session,
    SwingSettings,
    keep_measurements,
    new_session_file,
    probe,
    save_parameters,
    swing_search,
)
from tri_glide_kinematics.checks import non_negative
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import file_in
from tri_glide_kinematics.motion.shaping import ShaperKind
from tri_glide_kinematics.nodes.calibration_link import CalibrationLink, delivery_of
from tri_glide_kinematics.reason_log import ReasonLog
from tri_glide_kinematics.ros.inputs import SliderMeasurements
from tri_glide_kinematics.ros.live_parameters import LiveParameters
from tri_glide_kinematics.ros.loop import Cycle
from tri_glide_kinematics.ros.serving import CALLS, Answers, PatientServices
from tri_glide_kinematics.settings import (
    CALIBRATION_NODE,
    ParameterError,
    Values,
    check_joint_names,
    machine_of,
    workspace_limits_of,
)
from tri_glide_kinematics.simulation import TrueMachine
from tri_glide_kinematics.tri_glide import TriGlide

Answer = Callable[[Any, Any], Awaitable[None]]

PERIOD = 0.005  # s, from look to look at what is measured
# None may be missing between two looks.
MEASURED = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)
# Of a search for modes.
SOURCES = (FindModes.Request.ACCELEROMETER, FindModes.Request.MEASURED_HEIGHTS)
# An answer is on its way for this time; the node does not end before [s].
FAREWELL = 0.2


class CalibrationNode(Node):
    """Answers to services; it leads ik_node by twists to probe, and by goals to find the modes.

    Heights are noted as they are reported: the offsets are part of what is to be found out.
    """

    def __init__(self) -> None:
        """Declare the parameters and offer the services.

        Raises:
            KinematicsError: if a parameter has a value that it cannot work with.
        """
        super().__init__("calibration_node")
        self._values = values = LiveParameters(self, CALIBRATION_NODE, check_joint_names).values
        present = MachineParameters(machine_of(values).geometry, values["height_offsets"])
        self._drawing = drawing_of(values) or present
        # With the travel of the sliders as the drives report it.
        self._workspace = workspace_limits_of({**values, "height_offsets": (0.0, 0.0, 0.0)})
        self._reader = SliderMeasurements(values["joint_names"])
        self._folder = folder_of(values)
        # Of the present session; none until it has a measurement.
        self._session_file: Path | None = None
        self._session = Session(plate_of(values), self._keep)
        self._believed = TrueMachine(TriGlide(present.geometry), present.height_offsets)
        self._unusable = ReasonLog(self.get_logger().warning, lines_per_second=1)
        self._link = CalibrationLink(self, values["base_frame"], self._unusable)
        self._leading = self._link.leading
        self._searches = 0
        self._search_ended = -math.inf
        self.create_timer(1.0, self._unusable.end_of_second)
        self._answers = Answers(self)
        # rclpy's type hints know of no callback that gets to know when a message was sent.
        on_measured: Any = self._on_measured
        measured = self.create_subscription(
            JointState, "joint_states", on_measured, MEASURED, raw=True
        )
        services: tuple[tuple[str, type, Answer], ...] = (
            ("record_touch", RecordTouch, self._record_touch),
            ("record_position", RecordPosition, self._record_position),
            ("record_distance_end", RecordDistanceEnd, self._record_distance_end),
            ("probe", ProbePlate, self._probe),
            ("drop", DropMeasurement, self._drop),
            ("save", SaveMeasurements, self._save),
            ("load", LoadMeasurements, self._load),
            ("solve", SolveCalibration, self._solve),
            ("find_modes", FindModes, self._find_modes),
        )
        # The services share a reentrant group: one that waits keeps no other from its turn.
        group = ReentrantCallbackGroup()
        for name, kind, answer in services:
            answered = partial(self._answered, name, answer)
            self.create_service(
                kind, f"~/{name}", answered, qos_profile=CALLS, callback_group=group
            )
        self.create_service(ListMeasurements, "~/list", self._list, qos_profile=CALLS)
        self.create_service(Trigger, "~/stop", self._stop, qos_profile=CALLS)
        inputs = (measured, self._link.contacts)
        self.cycle = Cycle(inputs, PERIOD, self._link.step, may_end=self._may_end)
        PatientServices(self)

    def _may_end(self) -> bool:
        """Bring to rest what moves for a search, and return whether all who asked know."""
        self._leading.end("calibration_node ends")
        is_answered = time.monotonic() > self._search_ended + FAREWELL
        return is_answered and not self._searches

    def _on_measured(self, data: bytes, info: dict[str, Any]) -> None:
        try:
            reading = self._reader.read(data)
        except KinematicsError as error:
            self._unusable.add(f"unusable measurement: {error}")
            return
        if reading is None:
            return
        self._leading.measured(reading.heights, reading.stamp, delivery_of(info))

    async def _answered(self, name: str, answer: Answer, request: Any, response: Any) -> Any:
        """Return the response; while it waits for the machine, the node does all else."""
        with self._answers.told_in(response, name):
            self._leading.check_free()
            await answer(request, response)
        return response

    def _led(self, course: Generator[None, None, Any]) -> Future:
        """Begin with a ``course``, and return what will hold its result, or what it raises."""
        future = Future()
        self._leading.begin(course, future, time.monotonic())
        return future

    async def _record_touch(self, request: Any, response: Any) -> None:
        deviation = requested(self._values, request, "standard_deviation", "touch_deviation")
        heights = await self._led(self._leading.resting_heights())
        response.number = self._session.touch(heights, deviation, request.plate)
        response.message = self._session.lines()[-1]

    async def _record_position(self, request: Any, response: Any) -> None:
        deviation = requested(self._values, request, "standard_deviation", "position_deviation")
        place = (request.position.x, request.position.y, request.position.z)
        heights = await self._led(self._leading.resting_heights())
        response.number = self._session.position(heights, place, deviation, request.frame)
        response.message = self._session.lines()[-1]

    async def _record_distance_end(self, request: Any, response: Any) -> None:
        deviation = requested(self._values, request, "standard_deviation", "distance_deviation")
        distance = non_negative("distance", request.distance, "m")
        heights = await self._led(self._leading.resting_heights())
        response.number = self._session.distance_end(heights, distance, deviation)
        response.message = self._session.lines()[-1] if response.number else "first end noted"

    async def _probe(self, request: Any, response: Any) -> None:
        deviation = requested(self._values, request, "standard_deviation", "touch_deviation")
        settings = probe_settings_of(self._values, request)
        place_of = self._believed.position
        result = await self._led(probe(self._leading, self._link, place_of, settings))
        response.heights = result.heights
        response.overrun = result.overrun
        response.number = self._session.touch(result.heights, deviation, request.plate)
        response.message = "; ".join(filter(None, (self._session.lines()[-1], result.text)))

    def _list(self, _: Any, response: Any) -> Any:
        response.measurements = self._session.lines()
        missing = self._session.missing
        response.message = f"missing: {missing}" if missing else ""
        return response

    def _stop(self, _: Any, response: Any) -> Any:
        """End what moves the platform."""
        is_active = self._leading.stop()
        response.success = True
        response.message = "the platform comes to rest" if is_active else "nothing is under way"
        return response

    async def _drop(self, request: Any, response: Any) -> None:
        response.message = f"dropped {self._session.drop(request.number)}"

    async def _save(self, request: Any, response: Any) -> None:
        file = file_in(self._folder, request.file)
        save_measurements(file, self._content())
        response.message = f"{len(self._session.measurements)} measurements: {file}"

    async def _load(self, request: Any, response: Any) -> None:
        file = file_in(self._folder, request.file)
        content = load_measurements(file)
        self._session_file = None
        self._session.replace((*content.touches, *content.positions, *content.distances))
        response.count = len(self._session.measurements)
        response.message = f"{response.count} measurements of {file}"

    async def _solve(self, request: Any, response: Any) -> None:
        # Loaded when it is first used: it takes as long as starting the node.
        from tri_glide_kinematics.calibration.session import contradiction, report, solved

        named = request.parameter_file
        file = file_in(self._folder, named) if named else None
        calibration = solved(self._content())
        if file is not None:
            if calibration.is_contradicted:
                raise SavingError(f"no parameter file: {contradiction(calibration)}")
            save_parameters(file, calibration.machine, self._drawing)
        numbers = calibration.machine.vector.tolist()
        response.anchors = numbers[0:6]
        response.arm_lengths = numbers[6:9]
        response.height_offsets = numbers[9:12]
        response.standard_deviations = calibration.standard_deviations.tolist()
        response.message = report(calibration)

    async def _find_modes(self, request: Any, response: Any) -> None:
        self._searches += 1
        try:
            await self._search_modes(request, response)
        finally:
            self._searches -= 1
            self._search_ended = time.monotonic()

    async def _search_modes(self, request: Any, response: Any) -> None:
        # Loaded when they are first used, as those of ``_solve`` are.
        from tri_glide_kinematics.calibration.ringdown import (
            NoModeError,
            combine_modes,
            combined_report,
            find_modes,
            save_modes,
            save_recording,
        )
        from tri_glide_kinematics.calibration.session import STOPS

        settings = swing_settings_of(request)
        kind = shaper_kind_of(request.shaper)
        named = request.parameter_file
        parameter_file = file_in(self._folder, named) if named else None
        name, count = request.recordings, len(STOPS) * len(settings.directions)
        files = [file_in(self._folder, f"{name}_{place + 1}.csv") for place in range(count) if name]
        is_by_heights = request.source == FindModes.Request.MEASURED_HEIGHTS
        names = self._values["joint_names"] if is_by_heights else None
        search = await self._led(swing_search(self._leading, self._link, settings, names))
        for number, (file, recording) in enumerate(zip(files, search.recordings), 1):
            save_recording(file, recording, f"swing {number} of {count}")
        if search.failure is not None:
            raise LeadingError(search.failure)
        response.files = list(map(str, files))
        found = combine_modes([find_modes(recording) for recording in search.recordings])
        response.swings = len(found.ringdowns)
        response.frequencies = [mode.frequency for mode in found.modes]
        response.dampings = [mode.damping for mode in found.modes]
        response.frequency_deviations = [mode.frequency_deviation for mode in found.modes]
        response.damping_deviations = [mode.damping_deviation for mode in found.modes]
        response.seen = list(found.seen)
        if found.reason is not None:
            response.reason = getattr(FindModes.Response, found.reason.name)
            raise NoModeError(found.reason, combined_report(found))
        written = [f"recordings: {files[0]} to {files[-1].name}"] if files else []
        if parameter_file is not None:
            save_modes(parameter_file, found, kind)
            written.append(f"parameter file for ik_node: {parameter_file}")
        response.message = "\n\n".join((combined_report(found), *written))

    def _keep(self) -> None:
        """Write the present session to the disk.

        Raises:
            SavingError: if that is not possible.
        """
        if not self._session.measurements:
            # All are dropped: their file stays as it is, and what comes gets another one.
            self._session_file = None
            return
        if self._session_file is None:
            self._session_file = new_session_file(self._folder, datetime.now())
            self.get_logger().info(f"measurements are kept in {self._session_file}")
        keep_measurements(self._session_file, self._content())

    def _content(self) -> MeasurementFile:
        priors = priors_of(self._values)
        return self._session.content(self._drawing, priors, self._workspace)


def folder_of(values: Values) -> Path:
    """Return the folder of all files that services name.

    Raises:
        SavingError: if there is no such folder.
    """
    folder = Path(values["folder"]).expanduser().resolve()
    if not folder.is_dir():
        raise SavingError(f"folder = {values['folder']!r}: {folder} is no folder")
    return folder


def drawing_of(values: Values) -> MachineParameters | None:
    """Return the machine of the drawing; None if that is the present one.

    Raises:
        ParameterError: if no machine is like that.
    """
    drawn = values["drawn_machine"]
    if not any(drawn):
        return None
    try:
        return MachineParameters.from_vector(drawn)
    except KinematicsError as error:
        # It names parts of the machine, and other parameters have these names.
        raise ParameterError(f"drawn_machine: {error}") from error


def plate_of(values: Values) -> Plate:
    """Return the plate that is touched, with what is known of it."""
    known = values["plate_known"]
    height = values["plate_height"] if known == "height_and_tilt" else None
    tilt = None if known == "nothing" else values["plate_tilt"]
    return Plate(values["plate_name"], height, tilt)


def priors_of(values: Values) -> Priors | None:
    """Return how far a machine may be from its drawing; None if that is not known."""
    if not values["use_priors"]:
        return None
    return Priors(
        values["prior_anchors"],
        values["prior_arm_lengths"],
        values["prior_height_offsets"],
        common_radius=values["prior_common_radius"],
        common_arm_length=values["prior_common_arm_length"],
    )


def swing_settings_of(request: FindModes.Request) -> SwingSettings:
    """Return which moves a ``request`` asks for; what it leaves open is as by default.

    Raises:
        KinematicsError: if a number is outside its bounds.
    """
    default = SwingSettings()
    if len(request.place) > 1:
        raise LeadingError(f"{len(request.place)} places: the moves begin at one")
    if request.source not in SOURCES:
        raise LeadingError(f"source = {request.source}: it must be one of {SOURCES}")
    return SwingSettings(
        tuple((each.x, each.y, each.z) for each in request.directions) or default.directions,
        request.length or default.length,
        request.duration or default.duration,
        next(((each.x, each.y, each.z) for each in request.place), None),
    )


def shaper_kind_of(name: str) -> ShaperKind:
    """Return the kind of shaper of this name; EI if it is empty.

    Raises:
        LeadingError: if there is none.
    """
    try:
        return ShaperKind(name) if name else ShaperKind.EI
    except ValueError:
        known = ", ".join(kind.value for kind in ShaperKind)
        raise LeadingError(f"shaper = {name!r}: it must be one of {known}") from None


def probe_settings_of(values: Values, request: ProbePlate.Request) -> ProbeSettings:
    """Return how to probe; a depth [m] or speed [m/s] of zero is that of the ``values``.

    Raises:
        KinematicsError: if one is outside the bounds of its parameter.
    """
    return ProbeSettings(
        requested(values, request, "speed", "probe_speed"),
        requested(values, request, "depth", "probe_depth"),
        values["contact_timeout"],
        values["contact_delay"],
    )


def requested(values: Values, request: Any, name: str, parameter: str) -> float:
    """Return a number of a ``request``; 0 stands for the ``parameter`` in the ``values``.

    Raises:
        KinematicsError: if it is outside the bounds of the ``parameter`` that it takes the place
            of; the text gives it the ``name`` that it has in the request.
    """
    entry = next(one for one in CALIBRATION_NODE if one.name == parameter)
    return float(replace(entry, name=name).checked(getattr(request, name) or values[parameter]))
