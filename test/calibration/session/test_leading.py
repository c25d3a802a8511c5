"""Those who ask for the machine go on one by one."""

from concurrent.futures import Future

import pytest

from tri_glide_kinematics.calibration.session import Delivery, Leader, Leading, LeadingError

HEIGHTS = (0.6, 0.61, 0.62)


def begun(leading, course):
    future = Future()
    leading.begin(course, future, leading.now)
    return future


def steps(count, result):
    for _ in range(count):
        yield
    return result


def failing(error):
    yield
    raise error


def test_courses_go_on_side_by_side_and_one_that_fails_holds_up_nobody():
    leading = Leading()
    futures = [
        begun(leading, course)
        for course in (steps(3, "a"), failing(ZeroDivisionError("x")), steps(0, "b"))
    ]
    assert [each.done() for each in futures] == [False, False, True]
    leading.look(1.0)
    with pytest.raises(ZeroDivisionError):
        futures[1].result()
    leading.look(2.0)
    leading.look(3.0)
    assert [futures[0].result(), futures[2].result()] == ["a", "b"]


@pytest.mark.parametrize(("error", "stamp"), [(0.05, 7.05), (-0.2, 7.0), (1e9, 7.0)])
def test_a_stamp_by_another_clock_is_none(error, stamp):
    leading = Leading()
    for late in (-1.0, 0.0, 1.0):
        sent = Delivery(7.0 + late, 7.0 + late, 7.0 + late)
        leading.measured((late, 0.0, 0.0), 7.0 + late + error, sent)
    assert leading.record.at(stamp)[0] == pytest.approx(0.0, abs=1e-9)


def looking(leading, seen):
    while True:
        seen.append((yield from leading.next_look(1.0)))


def test_one_leads_until_it_has_to_end():
    leading, seen = Leading(), []
    leading.check_free()
    assert not leading.stop()
    future = begun(leading, leading.lead(Leader(), looking(leading, seen), "a dance"))
    with pytest.raises(LeadingError, match="a dance is under way"):
        leading.check_free()
    leading.look(0.5)
    leading.fail("somebody else dances")
    assert leading.stop()
    leading.look(1.0)
    with pytest.raises(LeadingError, match=r"^somebody else dances$"):
        future.result()
    assert seen == [0.5]
    leading.check_free()


def test_one_that_was_held_up_leads_no_more():
    leading = Leading()
    future = begun(leading, leading.lead(Leader(), looking(leading, []), "a dance"))
    leading.look(1.5)
    with pytest.raises(LeadingError, match=r"this node was held up for 1\.5 s"):
        future.result()
    leading.check_free()


def test_what_was_not_heard_is_not_idle():
    with pytest.raises(LeadingError, match="ik_node is not heard yet"):
        Leading().check_idle()
