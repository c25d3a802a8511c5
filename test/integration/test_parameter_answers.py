"""Each call that sets parameters is answered, with a reason where it sets nothing."""

import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from shared_machine import shared_nodes

from tri_glide_kinematics.settings import SIMULATOR_NODE

LAST_TYPE = 9
UNKNOWN = LAST_TYPE + 1
GOOD = Parameter(name="lag", value=ParameterValue(type=3, double_value=0.01))
STRANGE = Parameter(name="lag", value=ParameterValue(type=UNKNOWN, double_value=0.02))


@pytest.fixture(scope="module")
def client(ros_context, tmp_path_factory):
    with shared_nodes(ros_context, tmp_path_factory, "parameter_answers") as (client, launcher):
        launcher.start("simulator_node")
        yield client


def lag(client):
    request = GetParameters.Request(names=["lag"])
    answer = client.call(GetParameters, "simulator_node/get_parameters", request)
    return answer.values[0].double_value


def test_a_type_that_does_not_exist_is_refused_by_its_number(client):
    request = SetParameters.Request(parameters=[STRANGE, GOOD])
    refused, good = client.call(SetParameters, "simulator_node/set_parameters", request).results
    assert not refused.successful
    assert f"lag: type = {UNKNOWN} must be 0 to {LAST_TYPE}" in refused.reason
    assert good.successful
    assert lag(client) == GOOD.value.double_value


def test_of_a_set_with_such_a_type_nothing_is_set(client):
    before = lag(client)
    other = Parameter(name="lag", value=ParameterValue(type=3, double_value=before + 0.01))
    request = SetParametersAtomically.Request(parameters=[other, STRANGE])
    service = "simulator_node/set_parameters_atomically"
    result = client.call(SetParametersAtomically, service, request).result
    assert not result.successful
    assert f"type = {UNKNOWN}" in result.reason
    assert lag(client) == before


TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)


@st.composite
def parameter_values(draw):
    """Draw a value whose number of a type may not fit its content, or exist at all."""
    value = ParameterValue(type=draw(st.integers(0, 12) | st.integers(0, 255)))
    value.bool_value = draw(st.booleans())
    value.integer_value = draw(st.integers(-(2**63), 2**63 - 1))
    value.double_value = draw(st.floats())
    value.string_value = draw(TEXTS)
    value.bool_array_value = draw(st.lists(st.booleans(), max_size=4))
    value.double_array_value = draw(st.lists(st.floats(), max_size=4))
    value.integer_array_value = draw(st.lists(st.integers(-9, 9), max_size=4))
    value.string_array_value = draw(st.lists(TEXTS, max_size=4))
    return value


def test_whatever_is_asked_for_is_answered_with_a_reason(client):
    known = [*(entry.name for entry in SIMULATOR_NODE), "use_sim_time"]
    names = st.sampled_from(known) | TEXTS
    anything = st.builds(
        lambda name, value: Parameter(name=name, value=value), names, parameter_values()
    )

    @seed(23)
    @settings(
        max_examples=150,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.lists(anything, max_size=3))
    def ask(asked):
        request = SetParameters.Request(parameters=asked)
        results = client.call(SetParameters, "simulator_node/set_parameters", request).results
        assert len(results) == len(asked)
        assert all(result.successful or result.reason for result in results)
        assert not any("internal error" in result.reason for result in results)

    ask()
