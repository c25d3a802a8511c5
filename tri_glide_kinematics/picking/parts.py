"""Parts on a belt, in its own frame: what is seen twice there is one part, which ends once.

A point that is at p in the frame of the machine while the belt is at s has the coordinates
p - s d in the frame of the belt, which runs along d. They stay while the part lies on it.

Where a part is seen decides which one it is, and nothing else: identities are missing, change, or
come again for another part. Two parts are never nearer to each other than their spacing. So
whatever is seen within half of that of a part is this part. What is seen a little farther away is
noise of it or a neighbour: that is a part when it is seen again.
"""

from __future__ import annotations

import math
from bisect import insort
from collections import Counter
from collections.abc import Iterable, Sequence
from enum import IntEnum
from math import dist, hypot
from typing import NamedTuple

from tri_glide_kinematics.checks import finite, finite_vector, positive
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.vectors import Vector3, combined, three

# What is seen within so many times the reach of a part, and not within that, is in doubt.
DOUBTFUL = 1.5

# So many of the newest views say where a part is to be looked for: it may move on the belt.
NEWEST = 2

# A part has moved where the mean of so many of the newest views of a camera is off that of the
# others by more than this many times its noise.
COMPARED = 3
MOVED = 5.0

# More views make no mean much better.
MOST_VIEWS = 100

# A part that has its outcome is remembered until it was not seen for so long [s].
REMEMBERED = 5.0


class PartOutcome(IntEnum):
    """What has become of a part."""

    PLACED = 1
    MISSED = 2
    LOST = 3
    PASSED = 4


class Sighting(NamedTuple):
    """What a camera has seen in a picture.

    Attributes:
        time: of the picture [s].
        position: of the part. Shape (3,) [m].
        kind: of the part.
        identity: by which the camera knows the part again; empty if it does not.
        angle: by which it is turned about z [rad].
        camera: which one has seen it.
    """

    time: float
    position: Vector3
    kind: str = ""
    identity: str = ""
    angle: float = 0.0
    camera: str = ""


class PartEndedError(KinematicsError):
    """A part is to have a second outcome."""

    def __init__(self, part: Part, outcome: PartOutcome) -> None:
        """Store the ``part``, and what was to be its second ``outcome``."""
        had = "" if part.outcome is None else part.outcome.name
        super().__init__(f"part {part.number} ended as {had}: it cannot end as {outcome.name}, too")
        self.part = part
        self.outcome = outcome


class Part:
    """One part on the belt.

    Attributes:
        number: its own, ascending.
        views: what was seen of it, in the frame of the belt and in the order of time; what was
            seen before it moved on the belt is left out.
        position: mean of the views, in the frame of the belt. Shape (3,) [m].
        newest: mean of the newest views. Shape (3,) [m].
        is_doubtful: whether it was seen once only, and may be noise of another part.
        is_taken: whether it is being picked: so it stays, where two are found to be one, and is not
            lost with the others.
        outcome: None until it has one.
        text: what is to be said of the outcome.
        ended: when that was [s].
    """

    def __init__(self, number: int, is_doubtful: bool) -> None:
        """Have no view yet."""
        self.number, self.is_doubtful = number, is_doubtful
        self.views: list[Sighting] = []
        self.position = self.newest = (0.0, 0.0, 0.0)
        self.is_taken = False
        self.outcome: PartOutcome | None = None
        self.text = ""
        self.ended = -math.inf

    @property
    def kind(self) -> str:
        """Of which kind it was seen most often."""
        return Counter(view.kind for view in self.views).most_common(1)[0][0]

    @property
    def angle(self) -> float:
        """Mean of the angles of its views [rad]."""
        return math.atan2(
            sum(math.sin(view.angle) for view in self.views),
            sum(math.cos(view.angle) for view in self.views),
        )

    def distance(self, place: Vector3) -> float:
        """Return how far from a ``place`` it was seen last, in x and y [m]."""
        (x, y, _), mean_place, last = place, self.newest, self.views[-1].position
        return min(hypot(mean_place[0] - x, mean_place[1] - y), hypot(last[0] - x, last[1] - y))

    def may_be(self, view: Sighting) -> bool:
        """Return whether a ``view`` may show it: it has not ended, or lies there nevertheless."""
        if self.outcome is None or view.time <= self.ended:
            return True
        return self.outcome is not PartOutcome.PLACED and not self.is_over(view.time)

    def is_over(self, time: float) -> bool:
        """Return whether it has ended or is in doubt, and was not seen for long at a time [s]."""
        last = max(self.ended, self.views[-1].time)
        return (self.outcome is not None or self.is_doubtful) and time - last > REMEMBERED

    def add(self, views: Iterable[Sighting], noise: float) -> None:
        """Add ``views``, in the frame of the belt, with a ``noise`` of x and y each, rms [m]."""
        for view in views:
            insort(self.views, view)
        self.is_doubtful &= len(self.views) == 1
        own = [view for view in self.views if view.camera == self.views[-1].camera]
        newest, others = own[-COMPARED:], own[:-COMPARED]
        if len(others) >= COMPARED:
            way = dist(mean(newest)[:2], mean(others)[:2])
            if way > MOVED * noise * math.sqrt(1.0 / len(newest) + 1.0 / len(others)):
                self.views = [view for view in self.views if view.time >= newest[0].time]
        del self.views[:-MOST_VIEWS]
        self.position, self.newest = mean(self.views), mean(self.views[-NEWEST:])


class Parts:
    """All parts on a belt that were seen, and those that have ended and may be seen again."""

    def __init__(self, direction: Vector3, spacing: float = 0.015, noise: float = 0.001) -> None:
        """Know no part.

        Args:
            direction: in which the belt runs, in the frame of the machine; of length 1. Shape (3,).
            spacing: least distance between two parts [m].
            noise: of x and y each in what a camera sees, rms [m].

        Raises:
            OutOfBoundsError: if one of the last two is not positive.
        """
        self._direction = direction
        self._reach = 0.5 * positive("spacing", spacing, "m")
        self._noise = positive("noise", noise, "m")
        self._parts: list[Part] = []
        self._count = 0

    def on_belt(self) -> list[Part]:
        """Return all parts that have no outcome yet, the one that was seen first at the front."""
        return [part for part in self._parts if part.outcome is None and not part.is_doubtful]

    def see(self, sighting: Sighting, belt_position: float) -> Part:
        """Return the part that was seen; it may be one that has ended.

        Args:
            sighting: what was seen.
            belt_position: at the time of the picture [m].

        Raises:
            NotFiniteError: if the time or a place is not finite.
        """
        time = finite("time", sighting.time)
        seen = three(finite_vector("position", sighting.position, 3))
        place = combined(1.0, seen, -finite("belt_position", belt_position), self._direction)
        view = sighting._replace(time=time, position=place)
        # Those that this may make one part are not farther away than this.
        near = [part for part in self._parts if part.distance(place) <= 2.0 * self._reach]
        near = [part for part in near if part.may_be(view)]
        part = min(near, key=lambda each: each.distance(place), default=None)
        if part is None or (distance := part.distance(place)) > self._reach:
            is_doubtful = part is not None and distance <= DOUBTFUL * self._reach
            self._parts = [part for part in self._parts if not part.is_over(view.time)]
            self._count += 1
            part = Part(self._count, is_doubtful)
            self._parts.append(part)
        part.add([view], self._noise)
        for other in near:
            is_other = other is not part and other in self._parts
            if is_other and other.distance(part.newest) <= self._reach:
                part = self._joined(part, other)
        return part

    def _joined(self, one: Part, other: Part) -> Part:
        """Return which of two parts stays: the two are one that noise has made two."""
        stays, goes = sorted(
            (one, other), key=lambda part: (part.outcome is None, not part.is_taken, part.number)
        )
        if goes.outcome is not None or goes.is_taken:
            return one
        stays.add(goes.views, self._noise)
        self._parts.remove(goes)
        return stays

    def end(self, part: Part, outcome: PartOutcome, text: str, time: float) -> None:
        """Give a ``part`` its ``outcome``, with what there is to be said of it.

        What pictures show of it after that ``time`` [s] is another part if it was placed, and
        still this one if it was not.

        Raises:
            PartEndedError: if it has one already.
        """
        if part.outcome is not None:
            raise PartEndedError(part, outcome)
        part.outcome, part.text, part.ended = outcome, text, time

    def lose(self, text: str, time: float) -> list[Part]:
        """End all parts on the belt as lost, as after a jump of its encoder, and return them.

        Those that are taken are not on it, but known no more either.
        """
        lost = [part for part in self.on_belt() if not part.is_taken]
        for part in lost:
            self.end(part, PartOutcome.LOST, text, time)
        self._parts = []
        return lost


def mean(views: Sequence[Sighting]) -> Vector3:
    """Return the mean of the positions of some ``views``, at least one. Shape (3,) [m]."""
    return three(sum(places) / len(views) for places in zip(*(view.position for view in views)))
