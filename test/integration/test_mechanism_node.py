"""mechanism_node as a process: all services, asked well and badly; samples of docs/services.md."""

import math
import random
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from mechanism_requests import example_2, nose_gear, textbook, turn
from message_filling import filled, interface

from tri_glide_interfaces.msg import CrankSweep, LandingGearMotion, TraceEvent
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
    """The five services of one mechanism_node, each asked through one client."""

    def __init__(self, client, nodes, namespace=None):
        self.node = nodes.start("mechanism_node", namespace=namespace)
        self._client = client
        root = "" if namespace == "/" else namespace or client.namespace
        self._clients = {
            name: client.node.create_client(kind, f"{root}/mechanism_node/{name}")
            for name, kind in SERVICES.items()
        }
        for name, service in self._clients.items():
            client.wait_for(service.service_is_ready, name)

    def send(self, name, request):
        return self._clients[name].call_async(request)

    def answer(self, name, request):
        future = self.send(name, request)
        self._client.wait_for(future.done, f"the answer of {name}")
        return future.result()

    def assert_alive(self, name):
        """Ask a good question and check the answer."""
        response = self.answer(name, GOOD[name]())
        assert response.success, response.message
        assert not response.message
        CHECKS[name](response)


@pytest.fixture
def services(client, nodes):
    return Services(client, nodes)


GOOD = {
    "solve_four_bar": lambda: SolveFourBar.Request(
        linkage=textbook(), crank_angle=math.radians(30.0), crank_velocity=10.0
    ),
    "trace_four_bar": lambda: TraceFourBar.Request(linkage=textbook(), sweep=turn()),
    "solve_f_mechanism": lambda: SolveFMechanism.Request(
        mechanism=example_2(), crank_angle=math.radians(146.0)
    ),
    "trace_f_mechanism": lambda: TraceFMechanism.Request(mechanism=example_2(), sweep=turn()),
    "solve_landing_gear": lambda: SolveLandingGear.Request(gear=nose_gear()),
}


def check_four_bar(response):
    open_pose, crossed_pose = response.poses
    assert math.degrees(open_pose.coupler_angle) == pytest.approx(88.837241, abs=1e-6)
    assert crossed_pose.rocker_velocity == pytest.approx(-2.661583, abs=1e-6)


def check_f_mechanism(response):
    angles = [math.degrees(pose.angle) for pose in response.poses]
    assert angles == pytest.approx([-75.688, -55.562, -18.443, -0.982], abs=5e-4)


def check_full_turn(response):
    assert len(response.angle) == len(response.c2_y) == 361
    assert response.turns_fully == TraceFMechanism.Response.YES


CHECKS = {
    "solve_four_bar": check_four_bar,
    "trace_four_bar": lambda response: np.testing.assert_equal(len(response.rocker_angle), 361),
    "solve_f_mechanism": check_f_mechanism,
    "trace_f_mechanism": check_full_turn,
    "solve_landing_gear": lambda response: np.testing.assert_allclose(
        response.hinge.force, (0.0, 0.0, 150.0 * 9.80665)
    ),
}


# test/nodes/mechanisms/ has all that is refused; here are one for each service, and what is large.
BAD = [
    ("solve_four_bar", SolveFourBar.Request(), "crank = 0 m must be greater than 0"),
    (
        "trace_four_bar",
        TraceFourBar.Request(
            linkage=textbook(), sweep=CrankSweep(crank_angles=np.linspace(0.0, 1.0, 2_000_000))
        ),
        "len(crank_angles) - 1 = 1999999",
    ),
    (
        "solve_f_mechanism",
        SolveFMechanism.Request(mechanism=example_2(rod_lengths=[NAN, 34.0, 54.0])),
        "mechanism.rod_lengths[0] = nan",
    ),
    (
        "trace_f_mechanism",
        TraceFMechanism.Request(mechanism=example_2(rod_lengths=[1.0] * 3), sweep=turn()),
        "no position",
    ),
    (
        "solve_landing_gear",
        SolveLandingGear.Request(
            gear=nose_gear(), motion=LandingGearMotion(spin_acceleration=-INFINITY)
        ),
        "motion.spin_acceleration = -inf",
    ),
]


def test_each_bad_request_is_told_why_and_the_next_good_one_is_answered(services):
    for name, request, reason in BAD:
        response = services.answer(name, request)
        assert not response.success
        assert reason in response.message
        services.assert_alive(name)
    assert [name for name, *_ in BAD] == list(SERVICES)


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
    for name, kind in SERVICES.items():
        for _ in range(60):
            request = GOOD[name]()
            # Some of them are scrambled in one part only, and get farther than the first check.
            fields = list(request.get_fields_and_field_types())
            part = getattr(request, source.choice(fields))
            scramble(part if hasattr(part, "get_fields_and_field_types") else request)
            response = services.answer(name, request)
            assert isinstance(response, kind.Response)
            assert response.success != bool(response.message)
            assert "internal error" not in response.message
            outcomes.add((name, response.success))
        services.assert_alive(name)
    assert {name for name, success in outcomes if not success} == set(SERVICES)


def documented_samples():
    """Return service, type and request of each sample call that the page has."""
    text = PAGE.read_text()
    calls = re.findall(
        r'^ros2 service call /mechanism_node/(?:[^"]|\\\n)*"[^"]*"', text, re.MULTILINE
    )
    return [shlex.split(call.replace("\\\n", " "))[3:] for call in calls]


def test_documented_samples_run_as_written(client, nodes):
    services = Services(client, nodes, "/")
    answers = {}
    for service, type_name, text in documented_samples():
        kind = interface(type_name)
        node, service_name = service.lstrip("/").split("/")
        assert node == "mechanism_node"
        assert SERVICES[service_name] is kind
        request = filled(kind.Request(), text)
        answers[service_name] = services.answer(service_name, request)
        assert answers[service_name].success, answers[service_name].message
    assert set(answers) == set(SERVICES)

    # What the page says about them.
    check_four_bar(answers["solve_four_bar"])
    check_f_mechanism(answers["solve_f_mechanism"])
    check_full_turn(answers["trace_f_mechanism"])
    trace = answers["trace_four_bar"]
    assert {event.kind for event in trace.events} == {TraceEvent.LIMIT}
    assert 0 < np.isnan(trace.rocker_angle).sum() < len(trace.rocker_angle) == 361
    assert np.isfinite(answers["solve_landing_gear"].hinge.moment).all()
