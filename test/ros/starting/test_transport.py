"""Which transport is chosen, by the environment alone."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tri_glide_kinematics.ros.starting import MIDDLEWARE_VARIABLES, choose_transport, transport_of
from tri_glide_kinematics.ros.starting.transport import TransportError, profile, profile_sources

SOURCES = profile_sources()
READ, FILE = SOURCES.variables[0], SOURCES.file
NOT_READ = {"FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"}
NOT_READ -= set(SOURCES.variables)
CELL = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    READ: str(profile("cell")),
}
COMPUTER = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", READ: str(profile("computer"))}
SET_UPS = {"cell": CELL, "computer": COMPUTER}


def named(name):
    return {"TRI_GLIDE_TRANSPORT": name}


def test_the_default_is_a_cell():
    assert transport_of({}).variables == {**named("cell"), **CELL}
    assert transport_of(named("")).variables == {**named("cell"), **CELL}


@pytest.mark.parametrize("name", SET_UPS)
def test_the_variable_chooses(name):
    transport = transport_of(named(name))
    assert transport.variables == {**named(name), **SET_UPS[name]}
    assert transport.text.startswith(f"TRI_GLIDE_TRANSPORT={name}: UDP on ")
    assert not transport.can_stall


def test_a_caller_may_have_another_default_and_the_variable_wins():
    assert transport_of({}, "computer").variables == {**named("computer"), **COMPUTER}
    assert transport_of(named("cell"), "computer").variables == {**named("cell"), **CELL}


@pytest.mark.parametrize("name", SET_UPS)
def test_a_process_that_inherits_a_choice_makes_the_same(name):
    first = transport_of(named(name))
    assert transport_of(first.variables) == first


def test_another_value_is_refused():
    with pytest.raises(TransportError) as raised:
        transport_of(named("Cell"))
    assert str(raised.value) == "TRI_GLIDE_TRANSPORT = 'Cell' must be one of computer, cell"


CYCLONE = {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}


@pytest.mark.parametrize("name", SET_UPS)
@pytest.mark.parametrize(
    ("own", "can_stall"),
    [
        (CYCLONE, False),
        ({**CYCLONE, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, False),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, True),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, True),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, True),
        ({"ROS_LOCALHOST_ONLY": "1"}, True),
        ({"ROS_LOCALHOST_ONLY": "1", "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}, True),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", READ: "my.xml"}, True),
        ({"FASTDDS_BUILTIN_TRANSPORTS": "LARGE_DATA"}, True),
        ({"FASTDDS_BUILTIN_TRANSPORTS": "DEFAULT"}, True),
        ({"FASTDDS_BUILTIN_TRANSPORTS": "UDPv6"}, False),
        *(({variable: "my.xml"}, False) for variable in SOURCES.variables),
        # Whoever sets this has the defaults of Fast DDS.
        *(({variable: "my.xml"}, True) for variable in NOT_READ),
    ],
)
def test_what_is_set_for_the_middleware_wins(name, own, can_stall):
    transport = transport_of({**named(name), **own})
    assert transport.variables == named(name)
    assert transport.can_stall is can_stall
    for key, value in own.items():
        assert f"{key}={value}" in transport.text
    assert f"TRI_GLIDE_TRANSPORT={name} has no effect" in transport.text
    assert ("shared memory" in transport.text) is can_stall


@pytest.mark.parametrize("name", SET_UPS)
@pytest.mark.parametrize(
    "own",
    [
        {"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
        {"ROS_LOCALHOST_ONLY": "0"},
        {"FASTDDS_BUILTIN_TRANSPORTS": ""},
    ],
)
def test_what_agrees_is_left_alone(name, own):
    transport = transport_of({**named(name), **own})
    assert transport.variables == {**named(name), **SET_UPS[name]}


@pytest.mark.parametrize(
    "own", [{"ROS_STATIC_PEERS": "10.0.0.7"}, {"ROS_DISCOVERY_SERVER": "10.0.0.7:11811"}]
)
def test_other_hosts_belong_to_a_cell_only(own):
    assert transport_of({**named("cell"), **own}).variables == {**named("cell"), **CELL}
    transport = transport_of({**named("computer"), **own})
    assert transport.variables == named("computer")
    assert transport.can_stall


def test_a_profile_in_the_working_directory_wins(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / FILE).write_text("<dds/>")
    transport = transport_of({})
    assert transport.variables == named("cell")
    assert f"the file {FILE} in the working directory" in transport.text
    assert not transport.can_stall


def test_the_environment_of_the_process_is_set(monkeypatch):
    with monkeypatch.context() as patch:
        for key in (*MIDDLEWARE_VARIABLES, "TRI_GLIDE_TRANSPORT"):
            patch.setenv(key, "")  # so that the patch restores it
        transport = choose_transport("computer")
        assert {key: os.environ[key] for key in transport.variables} == transport.variables
        assert set(transport.variables) == {"TRI_GLIDE_TRANSPORT", *COMPUTER}


def test_the_sources_are_those_that_the_libraries_know():
    folders = os.environ["LD_LIBRARY_PATH"].split(os.pathsep)
    names = ("libfastrtps.so", "libfastdds.so", "librmw_fastrtps_shared_cpp.so")
    files = [path for folder in folders for name in names if (path := Path(folder, name)).exists()]
    content = b"".join(path.read_bytes() for path in files)
    for name in (*SOURCES.variables, FILE):
        assert name.encode() in content
    for name in NOT_READ:
        assert name.encode() not in content


def test_ros_is_not_imported_for_it():
    code = (
        "import sys; from tri_glide_kinematics.ros.starting.transport import choose_transport;"
        "choose_transport(); assert 'rclpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60.0)
