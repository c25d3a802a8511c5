"""A request is read within its bytes, whatever it says of what follows."""

import resource
from struct import pack

import pytest
from joined_domain import joined_domain
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.node import Node
from rclpy.serialization import serialize_message

from testing.client import Client
from testing.raw_writer import RawWriter, requests
from tri_glide_kinematics.ros.cdr import read_within_bytes

PLAIN = b"\0\1\0\0"
KIB_FOR_MILLIONS = 100_000  # 16 million texts take nine times as much


class Desk:
    """A node that is asked, and one who asks."""

    def __init__(self, context):
        self.client = Client(context, "/request_bytes")
        self.node = Node("asked", namespace="/request_bytes", context=context)
        read_within_bytes(self.node)
        (self._service,) = (each for each in self.node.services if each.srv_type is GetParameters)
        self._writer = RawWriter(
            self.client.node, GetParameters.Request, requests(self._service.service_name)
        )
        self.client.wait_for(self._writer.get_subscription_count, "a service that listens")

    def taken(self, *inputs):
        """Send bytes, then a request; return the names of all that are read up to that one."""
        last = ["the last one"]
        for data in (*inputs, bytes(serialize_message(GetParameters.Request(names=last)))):
            self._writer.publish(data)
        found = []

        def is_last_read():
            request, header = self._service.handle.service_take_request(GetParameters.Request)
            if header is not None:
                found.append(list(request.names))
            return last in found

        self.client.wait_for(is_last_read, "the last request")
        return found[:-1]

    def close(self):
        self._writer.close()
        self.node.destroy_node()
        self.client.close()


@pytest.fixture(scope="module")
def desk():
    with joined_domain() as context:
        its = Desk(context)
        yield its
        its.close()


def test_millions_of_texts_are_refused_before_they_are_made(desk):
    desk.taken()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    claims = [PLAIN + pack("<I", count) + bytes(4) for count in (16_000_000, 2**32 - 1)]
    assert desk.taken(*claims) == []
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < KIB_FOR_MILLIONS


def test_what_ends_too_early_is_refused(desk, capfd):
    whole = bytes(serialize_message(GetParameters.Request(names=["one", "two"])))
    assert desk.taken(whole, *(whole[:end] for end in range(4, len(whole) - 3))) == [["one", "two"]]
    assert "error state" not in capfd.readouterr().err


@pytest.mark.parametrize("kind", [b"\0\7", b"\0\3", b"\xff\xff"])
def test_an_encoding_that_ros_does_not_write_is_refused(desk, kind):
    whole = bytes(serialize_message(GetParameters.Request(names=["one"])))
    assert desk.taken(kind + whole[2:]) == []


def test_big_endian_and_other_services_are_read_as_ever(desk):
    assert desk.taken(b"\0\0\0\0" + pack(">II", 1, 4) + b"one\0") == [["one"]]
    asked = desk.client.node.create_client(ListParameters, "asked/list_parameters")
    read_within_bytes(desk.client.node)
    desk.client.wait_for(asked.service_is_ready, "the service")
    desk.client._executor.add_node(desk.node)
    future = asked.call_async(ListParameters.Request())
    desk.client.wait_for(future.done, "the answer")
    assert "use_sim_time" in future.result().result.names
