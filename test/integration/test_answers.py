"""What the response of a service tells of how it went."""

import pytest
from std_srvs.srv import Trigger

from tri_glide_interfaces.srv import TraceFourBar
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.ros.serving import Answers


@pytest.fixture
def answers(client):
    return Answers(client.node)


def test_what_is_done_is_a_success(answers):
    response = Trigger.Response()
    with answers.told_in(response, "trigger"):
        response.message = "done"
    assert (response.success, response.message) == (True, "done")


def test_a_refusal_tells_its_reason(answers):
    response = Trigger.Response()
    with answers.told_in(response, "trigger"):
        raise OutOfBoundsError("crank", -1.0, "at least 0", "m")
    assert not response.success
    assert response.message == "crank = -1 m must be at least 0 m"


def test_a_fault_of_ours_is_told_and_leaves_nothing_half_done(answers, capfd):
    response = TraceFourBar.Response()
    with answers.told_in(response, "trace_four_bar"):
        response.coupler_angle = [1.0, 2.0]
        raise ZeroDivisionError("division by zero")
    told = TraceFourBar.Response(message="internal error: ZeroDivisionError: division by zero")
    assert response == told
    assert "ZeroDivisionError" in capfd.readouterr().err, "nobody would find where it was"
