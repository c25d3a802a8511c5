"""Planning ends before a piece that would last too long."""

from tri_glide_kinematics.ros.loop import FORGETTING, PlanningTime

END = 1.0  # s


class Pieces:
    """Pieces of planning, and the clock that they take their time from."""

    def __init__(self):
        self.now = 0.0
        self.planning = PlanningTime(lambda: self.now)

    def work(self, seconds, end=END):
        """Do pieces of so many ``seconds``, as a cycle does; return how many."""
        may_go_on = self.planning.until(end)
        count = 0
        while True:
            self.now += seconds
            count += 1
            if not may_go_on():
                return count


def test_no_piece_ends_too_late_once_their_length_is_known():
    pieces = Pieces()
    assert pieces.work(0.3) == 3
    assert pieces.now < END
    pieces.now = 0.0
    assert pieces.planning.is_short(END)
    assert not pieces.planning.is_short(0.2)


def test_there_is_always_one_piece():
    pieces = Pieces()
    assert pieces.work(5.0) == 1
    assert pieces.work(5.0) == 1


def test_one_long_piece_is_forgotten():
    pieces = Pieces()
    pieces.work(10.0 * END)
    cycles = 0
    while True:
        pieces.now = 0.0
        cycles += 1
        if pieces.work(0.01) > 50:
            break
    assert 1.0 < cycles < 50
    assert 10.0 * FORGETTING**cycles < END


def test_planning_begins_only_for_a_piece_that_fits_or_has_waited_for_a_cycle():
    pieces = Pieces()
    pieces.work(0.3)
    pieces.now = 0.0
    pieces.planning.next_cycle()
    assert pieces.planning.may_begin(END)
    for _ in range(3):
        pieces.planning.next_cycle()
        assert not pieces.planning.may_begin(0.2)
        pieces.planning.next_cycle()
        assert pieces.planning.may_begin(0.2)
        assert not pieces.planning.may_begin(0.2)
        assert pieces.planning.may_begin(END)
