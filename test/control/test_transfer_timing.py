"""A transfer is kept in time, and so are its outputs: without an engine."""

from collections import deque
from types import SimpleNamespace

import pytest

from tri_glide_kinematics.control.transfer_timing import LARGEST_DRIFT, TransferTiming
from tri_glide_kinematics.motion.engine import Station, Transfer
from tri_glide_kinematics.motion.transfer import TransferError

PART = Station((0.0, 0.1, 0.25), 0.05, (0.2, 0.0, 0.0), outputs=((0.01, "close"),))
PLACE = Station((0.0, -0.1, 0.25), outputs=((-0.5, "early"), (0.02, "open")))


@pytest.fixture
def cell():
    """Return the timing of a transfer that has begun, and what it asks."""
    command = Transfer((PART, PLACE), 0.275, seen=9.9)
    progress = SimpleNamespace(arrivals=(0.4, 1.0), gives_up=None)
    renewed = []
    engine = SimpleNamespace(
        transfer_progress=progress,
        plan_number=1,
        elapsed=3.0,
        renew=lambda *told: renewed.append(told) or True,
    )
    queue = SimpleNamespace(present=10.0, behind=7.0)
    target = SimpleNamespace(command=command, due=deque())
    timing = TransferTiming(engine, queue, target)
    timing.begin(command)
    return SimpleNamespace(
        timing=timing, engine=engine, queue=queue, target=target, renewed=renewed
    )


def due(cell):
    return [(each.output, pytest.approx(each.instant)) for each in cell.target.due]


def test_outputs_are_due_by_the_arrivals_in_their_order_whatever_is_renewed(cell):
    assert due(cell) == [("close", 10.41), ("early", 10.5), ("open", 11.02)]
    cell.engine.transfer_progress.arrivals = (0.7, 1.1)
    cell.timing.look_after()
    assert due(cell)[0] == ("close", 10.41)
    # Only another plan arrives at another time.
    cell.engine.plan_number = 2
    cell.timing.look_after()
    assert due(cell) == [("early", 10.6), ("close", 10.71), ("open", 11.12)]


def test_what_an_engine_is_late_by_is_made_good_once(cell):
    cell.queue.present, cell.engine.elapsed = 10.1, 3.1
    cell.timing.look_after()
    cell.queue.present += 0.5 * LARGEST_DRIFT
    cell.timing.look_after()
    assert cell.renewed == []
    cell.queue.present = 10.2
    cell.timing.look_after()
    assert cell.renewed == [(0, PART, pytest.approx(0.3))]
    cell.timing.look_after()
    assert len(cell.renewed) == 1


def test_why_it_is_given_up_is_told_and_nothing_renewed(cell):
    cell.engine.transfer_progress.gives_up = reason = TransferError("missed")
    cell.queue.present = 11.0
    assert cell.timing.look_after() is reason
    assert cell.renewed == []
