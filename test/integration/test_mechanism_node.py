"""mechanism_node as a process: all services, asked as docs/services.md says, badly, at random."""

import copy
import math
import random
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from message_filling import filled, interface

from tri_glide_interfaces.msg import TraceEvent
from tri_glide_interfaces.srv import (
    SolveFMechanism,
    SolveFourBar,
    SolveLandingGear,
    TraceFMechanism,
    TraceFourBar,
)

PAGE = Path(__file__).parents[2] / "docs" / "services.md"
SERVICES = {
    "solve_four_bar": SolveFourBar,
    "trace_four_bar": TraceFourBar,
    "solve_f_mechanism": SolveFMechanism,
    "trace_f_mechanism": TraceFMechanism,
    "solve_landing_gear": SolveLandingGear,
}
NAN, INFINITY = math.nan, math.inf


class Services:
    """The five services of one mechanism_node, each asked through one client.

    Attributes:
        samples: requests of the sample calls that the page has, by the names of services.
    """

    def __init__(self, client, nodes):
        self.node = nodes.start("mechanism_node", namespace="/")
        self._client = client
        self._clients = {
            name: client.node.create_client(kind, f"/mechanism_node/{name}")
            for name, kind in SERVICES.items()
        }
        for name, service in self._clients.items():
            client.wait_for(service.service_is_ready, name)
        calls = re.findall(
            r'^ros2 service call /mechanism_node/(?:[^"]|\\\n)*"[^"]*"',
            PAGE.read_text(),
            re.MULTILINE,
        )
        self.samples = {}
        for call in calls:
            service, type_name, text = shlex.split(call.replace("\\\n", " "))[3:]
            name, kind = service.removeprefix("/mechanism_node/"), interface(type_name)
            assert SERVICES[name] is kind
            self.samples[name] = filled(kind.Request(), text)
        assert set(self.samples) == set(SERVICES)

    def answer(self, name, request):
        future = self._clients[name].call_async(request)
        self._client.wait_for(future.done, f"the answer of {name}")
        response = future.result()
        assert isinstance(response, SERVICES[name].Response)
        assert response.success != bool(response.message)
        assert "internal error" not in response.message
        return response

    def good_answer(self, name):
        response = self.answer(name, self.samples[name])
        assert response.success, response.message
        return response


@pytest.fixture
def services(client, nodes):
    return Services(client, nodes)


# test/nodes/mechanisms/ has all that is refused, and what is answered.
def test_documented_samples_run_as_written_after_bad_requests_too(services):
    answers = {}
    for name, kind in SERVICES.items():
        assert not services.answer(name, kind.Request()).success
        answers[name] = services.good_answer(name)
    large = copy.deepcopy(services.samples["trace_four_bar"])
    large.sweep.crank_angles = np.linspace(0.0, 1.0, 2_000_000)
    assert "len(crank_angles) - 1 = 1999999" in services.answer("trace_four_bar", large).message

    # What the page says about them.
    open_pose, crossed_pose = answers["solve_four_bar"].poses
    assert math.degrees(open_pose.coupler_angle) == pytest.approx(88.837241, abs=1e-6)
    assert crossed_pose.rocker_velocity == pytest.approx(-2.661583, abs=1e-6)
    angles = [math.degrees(pose.angle) for pose in answers["solve_f_mechanism"].poses]
    assert angles == pytest.approx([-75.688, -55.562, -18.443, -0.982], abs=5e-4)
    turn = answers["trace_f_mechanism"]
    assert len(turn.angle) == len(turn.c2_y) == 361
    assert turn.turns_fully == TraceFMechanism.Response.YES
    trace = answers["trace_four_bar"]
    assert {event.kind for event in trace.events} == {TraceEvent.LIMIT}
    assert 0 < np.isnan(trace.rocker_angle).sum() < len(trace.rocker_angle) == 361
    assert np.isfinite(answers["solve_landing_gear"].hinge.moment).all()


def test_random_contents_never_end_the_node(services):
    source = random.Random(3)
    numbers = [0.0, -1.0, 1.0, 0.5, 3.0, NAN, INFINITY, 1e9, 1e-300, -1e300, 5e-324]

    def scramble(message):
        for field, kind in message.get_fields_and_field_types().items():
            value = getattr(message, field)
            if isinstance(value, float):
                setattr(message, field, source.choice([*numbers, source.uniform(-4.0, 4.0)]))
            elif isinstance(value, np.ndarray):
                value[:] = [source.choice([1.0, 1.0, 2.0, *numbers]) for _ in value]
            elif isinstance(value, bool):
                setattr(message, field, source.random() < 0.5)
            elif kind.startswith("sequence<double>"):
                angles = [source.choice(numbers) for _ in range(source.randrange(4))]
                setattr(message, field, angles)
            elif isinstance(value, int):
                setattr(message, field, source.choice([0, 1, 2, 7, 255]))
            elif isinstance(value, list):
                for item in value:
                    scramble(item)
            else:
                scramble(value)

    outcomes = set()
    for name in SERVICES:
        for _ in range(60):
            request = copy.deepcopy(services.samples[name])
            # Some of them are scrambled in one part only, and get farther than the first check.
            fields = list(request.get_fields_and_field_types())
            part = getattr(request, source.choice(fields))
            scramble(part if hasattr(part, "get_fields_and_field_types") else request)
            outcomes.add((name, services.answer(name, request).success))
        services.good_answer(name)
    assert {name for name, success in outcomes if not success} == set(SERVICES)
