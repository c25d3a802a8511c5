"""What three drives on a bus count and are led with, and how much of the bus that takes."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.drives.cia402 import DriveError
from tri_glide_kinematics.errors import OutOfBoundsError

# What a drive counts, and the height of its slider: exact, whatever the gear.

# Numerator and denominator of a gear are no larger: each fits into an object of a drive.
LARGEST_PART = 2**32

# Positions of a drive (objects 0x6064 and 0x607A) are integers of 32 bits.
LARGEST_COUNT = 2**31 - 1


@dataclass(frozen=True)
class DriveUnits:
    """How far a slider goes for each count of its drive.

    Attributes:
        counts: so many for ``per`` micrometres of way; both are whole, so no gear is rounded.
        per: micrometres.
        direction: +1 if the drive counts up when the slider goes up, otherwise -1.
    """

    counts: int
    per: int
    direction: int = 1

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            OutOfBoundsError: if a part of the fraction is not within 1 and 2**32, or the direction
                is neither +1 nor -1.
        """
        for name in ("counts", "per"):
            value = getattr(self, name)
            if not (isinstance(value, int) and 1 <= value <= LARGEST_PART):
                raise OutOfBoundsError(name, value, f"a whole number from 1 to {LARGEST_PART}")
        if self.direction not in (1, -1):
            raise OutOfBoundsError("direction", self.direction, "1 or -1")

    @property
    def per_metre(self) -> Fraction:
        """Counts for each metre, without a sign."""
        return Fraction(self.counts * 10**6, self.per)

    def counts_of(self, height: float, zero: float) -> int:
        """Return what the drive counts at a height.

        Args:
            height: of the slider [m].
            zero: height at which the drive counts 0 [m].

        Raises:
            OutOfBoundsError: if the drive has no number of 32 bits for it.
        """
        above, below = height.as_integer_ratio()
        zero_above, zero_below = zero.as_integer_ratio()
        way = (above * zero_below - zero_above * below) * self.counts * 10**6 * self.direction
        unit = below * zero_below * self.per
        count = (2 * way + unit) // (2 * unit)
        if abs(count) > LARGEST_COUNT:
            bound = f"within {LARGEST_COUNT} counts of the height {zero:g}"
            raise OutOfBoundsError("height", height, bound, "m")
        return count

    def height_of(self, count: int, zero: float) -> float:
        """Return the height at which the drive counts so far [m]; ``zero`` as above."""
        above, below = zero.as_integer_ratio()
        unit = self.counts * 10**6
        return (above * unit + self.direction * count * self.per * below) / (below * unit)

    def rate_of(self, rate: float, name: str = "speed or acceleration") -> int:
        """Return a velocity [m/s] or an acceleration in counts, at least 1, without the direction.

        Raises:
            OutOfBoundsError: if the drive has no number of 32 bits for it.
        """
        counts = round(rate * self.per_metre)
        if counts >= LARGEST_PART:
            bound = f"below {LARGEST_PART} counts of the drive, it is {counts}"
            raise OutOfBoundsError(name, rate, bound)
        return max(1, counts)


LARGEST_NODE = 127

# Above this it is told, above that refused: what is left is for heartbeats, messages of faults,
# transfers, and frames that are repeated.
LARGEST_GOOD_LOAD = 0.6
LARGEST_LOAD = 0.8


def frame_bits(data_bytes: int) -> int:
    """Return the longest that a frame with an identifier of 11 bits can be, with its gap [bits].

    Stuffed bits come after each fifth equal bit, the last of them the first of the next five; 34
    bits besides the data are stuffed, 13 are not (ISO 11898-1).
    """
    stuffed = 34 + 8 * data_bytes
    return stuffed + 13 + (stuffed - 1) // 4


def bus_load(bitrate: int, period: float, sends_velocity: bool = False) -> float:
    """Return the share of time for which SYNC and PDOs of three drives use the bus, at the most.

    Args:
        bitrate: of the bus [bit/s].
        period: from one SYNC to the next [s].
        sends_velocity: whether a second PDO goes to each drive.
    """
    of_drive = 2 * frame_bits(6) + (frame_bits(4) if sends_velocity else 0)
    return (3 * of_drive + frame_bits(0)) / (bitrate * period)


@dataclass(frozen=True)
class DriveSettings:
    """One drive and its slider.

    Attributes:
        node: its node id on the bus, 1 to 127.
        units: what it counts.
        home_height: height of the slider where its homing ends, at its switch [m].
        lower_height: lower end of the slider's travel [m].
        upper_height: upper end [m].
        largest_speed: of the slider [m/s].
        brake: deceleration with which it brakes, in a quick stop, too [m/s^2].
        largest_torque: of 1/1000 of the rated torque (object 0x6072); None leaves what is set.
        largest_error: distance from the target that the drive allows (object 0x6065) [m]; None
            leaves what is set.
        homing_method: object 0x6098; None goes up to a limit switch at the top.
    """

    node: int
    units: DriveUnits
    home_height: float
    lower_height: float
    upper_height: float
    largest_speed: float = 1.0
    brake: float = 10.0
    largest_torque: int | None = None
    largest_error: float | None = None
    homing_method: int | None = None

    @property
    def method(self) -> int:
        """Object 0x6098: 17 and 18 go to the negative and the positive limit switch."""
        if self.homing_method is not None:
            return self.homing_method
        return 18 if self.units.direction > 0 else 17

    @property
    def homing_way(self) -> int:
        """Whether homing goes up (1) or down (-1) to a limit switch; 0 for what does neither."""
        return self.units.direction * {17: -1, 18: 1}.get(self.method, 0)

    @property
    def ends(self) -> tuple[float, float]:
        """The ends of the travel, the switch within it: lower, upper [m]."""
        heights = (self.lower_height, self.upper_height, self.home_height)
        return min(heights), max(heights)

    @property
    def travel(self) -> tuple[int, int]:
        """The ends as the drive counts: smaller, larger."""
        counts = [self.units.counts_of(height, self.home_height) for height in self.ends]
        return min(counts), max(counts)


@dataclass(frozen=True)
class GroupSettings:
    """Three drives, and what they have in common.

    Attributes:
        drives: in the order of the sliders.
        period: from one SYNC to the next [s]; a whole number of 0.1 ms, at most 25 ms.
        bitrate: of the bus [bit/s].
        playout_delay: for which setpoints are stored [s].
        own_node: node id of this computer.
        consumer_time: without a heartbeat for which a drive stops by itself, and is taken for
            lost; so are all that are silent for that long [s].
        sends_velocity: whether each drive gets the velocity (object 0x60B1) in a second PDO.
        homing_speed: towards the switch [m/s].
        homing_slow_speed: at the switch [m/s].
        homing_acceleration: [m/s^2].
        homing_timeout: for all of it [s].
        back_off: farther than this no slider goes down below its highest place in a homing by the
            default methods: its switch sticks [m].
    """

    drives: tuple[DriveSettings, DriveSettings, DriveSettings]
    period: float = 0.002
    bitrate: int = 1_000_000
    playout_delay: float = 0.01
    own_node: int = LARGEST_NODE
    consumer_time: float = 0.05
    sends_velocity: bool = False
    homing_speed: float = 0.05
    homing_slow_speed: float = 0.005
    homing_acceleration: float = 0.5
    homing_timeout: float = 60.0
    back_off: float = 0.05

    def __post_init__(self) -> None:
        """Check what the drives cannot.

        Raises:
            DriveError: if a node id stands twice, a homing leads the wrong way, or the cycles take
                more than 80 % of the bus.
            OutOfBoundsError: if a node id, the period or the consumer time is out of bounds, or a
                drive cannot count the travel of its slider.
        """
        names: dict[int, str] = {}
        nodes = (self.own_node, *(drive.node for drive in self.drives))
        for node, name in zip(nodes, ("the computer", "axis 1", "axis 2", "axis 3")):
            if not 1 <= node <= LARGEST_NODE:
                raise OutOfBoundsError(f"node id of {name}", node, "from 1 to 127")
            if node in names:
                raise DriveError(f"{names[node]} and {name} have the same node id {node}")
            names[node] = name
        homing = ("homing_speed", "homing_slow_speed", "homing_acceleration")
        common = {name: getattr(self, name) for name in homing}
        for number, drive in enumerate(self.drives, 1):
            rates = {**common, "largest speed": drive.largest_speed, "deceleration": drive.brake}
            if drive.largest_error is not None:
                rates["following error"] = drive.largest_error
            for name, rate in rates.items():
                named = f"{name} of axis {number}"
                drive.units.rate_of(positive(named, rate), named)
            # What looks for another switch than that at the home height would tell wrong heights.
            above = drive.home_height - 0.5 * (drive.lower_height + drive.upper_height)
            if drive.homing_way * above < 0.0:
                raise DriveError(
                    f"method {drive.method} of homing of node {drive.node} goes away from the home "
                    f"height {drive.home_height:g} m"
                )
            # Raises where a number of 32 bits is too small.
            assert drive.travel
        if {-1, 1} <= {drive.homing_way for drive in self.drives}:
            raise DriveError("some drives go up in their homing, others down: arms do not reach")
        tenths = round(self.period * 1e4)
        if not 1 <= tenths <= 255 or abs(tenths - self.period * 1e4) > 1e-6:
            bound = "a whole number of 0.1 ms, at most 25 ms"
            raise OutOfBoundsError("period [s]", self.period, bound)
        if not 4.0 * self.period <= self.consumer_time <= 60.0:
            bound = f"from 4 periods, {4 * self.period:g} s, to 60"
            raise OutOfBoundsError("heartbeat timeout", self.consumer_time, bound, "s")
        if self.load > LARGEST_LOAD:
            raise DriveError(
                f"the bus of {self.bitrate} bit/s is in use for {100 * self.load:.0f} % of the "
                f"time with a period of {1e3 * self.period:g} ms; "
                f"at most {100 * LARGEST_LOAD:.0f} % is allowed"
            )

    @property
    def load(self) -> float:
        """Share of time for which the cycles use the bus."""
        return bus_load(self.bitrate, self.period, self.sends_velocity)

    @property
    def microseconds(self) -> int:
        """The period [us]: a whole number of 0.1 ms."""
        return 100 * round(self.period * 1e4)
