"""A call of cia402_node is answered, or ends the node: it is never dropped."""

import asyncio

import pytest
from std_srvs.srv import SetBool

from tri_glide_kinematics.drives import DriveError, GroupState
from tri_glide_kinematics.nodes.cia402_node import Cia402Node
from tri_glide_kinematics.ros.starting import FatalError


def answered(error: Exception) -> SetBool.Response:
    """Return the answer where the group of drives raises an ``error``."""

    def ask(now: float) -> None:
        raise error

    # It needs no bus for this.
    node = Cia402Node.__new__(Cia402Node)
    return asyncio.run(node._answer(SetBool.Response(), ask, GroupState.ON))


def test_what_is_refused_is_answered_and_what_is_broken_ends_the_node():
    answer = answered(DriveError("the sliders move"))
    assert not answer.success and answer.message == "the sliders move"
    with pytest.raises(FatalError, match="RuntimeError: broken"):
        answered(RuntimeError("broken"))
