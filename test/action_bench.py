"""A machine and a client of its actions, for tests of how goals end."""

from testing.client import DEEP_QUEUE
from testing.goals import GoalClient
from testing.machine import Machine
from tri_glide_kinematics.motion.engine import GoalCode

NEAR, FAR = (0.0, 0.0, 0.25), (0.08, 0.03, 0.35)
# A way of seconds, so that what is to end it comes in time.
SLOW = {"speed_scale": 0.05}
# So slow that a goal is under way still when a busy computer has done all that a test does.
CREEPING = 0.005


class ActionBench:
    """A machine and a client of its actions."""

    def __init__(self, client, launcher):
        self.client = client
        self.machine = Machine(client, launcher)
        # A busy computer may answer many goals before this client looks.
        self.goals = GoalClient(self.client, DEEP_QUEUE)

    def start(self, parameters=SLOW):
        self.machine.start(parameters)
        self.goals.wait_for_server()
        return self

    def set_speed(self, scale):
        assert self.client.set_parameters("ik_node", {"speed_scale": scale}).successful

    def quickly_to(self, position):
        """Be at a position, whatever was before."""
        self.set_speed(1.0)
        assert self.goals.move_to(position).result().code == GoalCode.SUCCEEDED
        self.machine.catch_up()
        self.set_speed(SLOW["speed_scale"])

    def under_way(self):
        """Return a goal that is far from its end."""
        self.quickly_to(NEAR)
        first = len(self.machine.commands)
        goal = self.goals.move_to(FAR).wait_until_accepted()
        self.client.wait_for(
            lambda: any(max(map(abs, m.velocity)) > 0.04 for m in self.machine.commands[first:]),
            "full motion",
        )
        self.set_speed(CREEPING)
        assert goal.response is None
        return goal

    def ends(self, goal, status, code, text):
        """Check how a goal ends."""
        result = goal.result()
        assert (goal.status, result.code) == (status, code), result.text
        assert text in result.text
        assert goal.responses == 1
        return result
