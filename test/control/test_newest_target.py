"""What is said of a target from the last setpoint on, until there is another one."""

from controller_rig import IN_POSITION

from tri_glide_kinematics.control import Arrival, Cause, NewestTarget, Reason
from tri_glide_kinematics.motion.engine import Move

BECAUSE = Reason(Cause.COMMAND, "because")


def test_the_target_after_a_missed_one_is_not_missed_and_not_judged_yet():
    target = NewestTarget(IN_POSITION)
    target.take(Move((0.0, 0.0, 0.3)), BECAUSE)
    target.judge_from(0.0)
    target.measured(0.002, 0.6)
    assert target.arrival(0.6)[0] is Arrival.NOT_REACHED and target.is_missed
    target.take(Move((0.0, 0.0, 0.2)), BECAUSE)
    assert not target.is_missed and target.distance is None
    assert target.arrival(9.0) == (Arrival.SETTLING, None)
    assert "0.2" in target.text
    assert target.position == (0.0, 0.0, 0.2)
