"""Results of goals that ended some time ago."""

import gc

from tri_glide_interfaces.action import FollowPath
from tri_glide_kinematics.ros.serving.action_server import MOST, OldResults

RESULT = FollowPath.Impl.GetResultService.Response


def test_a_result_is_kept_as_it_was():
    results = OldResults(RESULT)
    result = RESULT(status=4)
    result.result.text, result.result.largest_deviation = "reached", 0.001
    results.add(b"one", result)
    assert results.get(b"one") == result
    assert results.get(b"two") is None
    assert b"one" in results
    assert b"two" not in results


def test_the_newest_are_kept_and_the_collector_of_garbage_does_not_see_them():
    results = OldResults(RESULT)
    before = len(gc.get_objects())
    for number in range(MOST + 500):
        results.add(number.to_bytes(16, "big"), RESULT())
        results.forget()
    assert [number for number in range(MOST + 500) if number.to_bytes(16, "big") in results] == [
        *range(500, MOST + 500)
    ]
    assert len(gc.get_objects()) - before < MOST // 2
