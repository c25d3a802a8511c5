"""A controller as ``ik_node`` has it with the default parameters, but for what is to be quick."""

from collections.abc import Callable

from tri_glide_kinematics.control import (
    ControllerStatus,
    InPositionBounds,
    MotionController,
    Streams,
    SupervisionBounds,
    Supervisor,
)
from tri_glide_kinematics.errors import Refusal
from tri_glide_kinematics.motion import MotionEngine

PERIOD, TWIST_TIMEOUT, MEASURED_TIMEOUT, TARGET_TIMEOUT = 0.002, 0.1, 0.2, 0.3  # s
LOWER, UPPER = (0.3, 0.3, 0.3), (0.9, 0.9, 0.9)  # m
IN_POSITION = InPositionBounds(tolerance=0.0005, settling_time=0.02, timeout=0.5, error_limit=0.005)


def supervisor() -> Supervisor:
    """Return what watches over the measurements."""
    bounds = SupervisionBounds(MEASURED_TIMEOUT, 0.02, 0.05, (1.0, 1.0, 1.0))
    return Supervisor(bounds, ("slider_1", "slider_2", "slider_3"))


def controller_of(
    engine: MotionEngine,
    on_change: Callable[[ControllerStatus], None] = lambda status: None,
    on_refusal: Callable[[str, Refusal], None] = lambda text, refusal: None,
    *,
    start_disabled: bool = False,
    drive_delay: float = 0.0,
) -> MotionController:
    """Return a controller of an ``engine``, which tells states and refusals."""
    return MotionController(
        engine,
        supervisor(),
        period=PERIOD,
        streams=Streams.with_timeouts(TWIST_TIMEOUT, TARGET_TIMEOUT),
        in_position_bounds=IN_POSITION,
        start_disabled=start_disabled,
        travel=(LOWER, UPPER),
        on_change=on_change,
        on_refusal=on_refusal,
        drive_delay=drive_delay,
    )
