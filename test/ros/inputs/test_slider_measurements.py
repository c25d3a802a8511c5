"""What is read from the bytes of measurements is what is read from the messages."""

import math
import random
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.inputs import SliderMeasurements, slider_measurements
from tri_glide_kinematics.ros.inputs.slider_measurements import MOST_LAYOUTS
from tri_glide_kinematics.ros.messages import RefusedMessageError

NAMES = ["slider_1", "slider_2", "slider_3"]
TEXTS = ("", "a", "ab", "abc", "frame", "tri_glide_base", "größe")


@pytest.fixture
def slow_reads(monkeypatch):
    """Return how many messages are read part by part from now on, in a list."""
    count = [0]
    read = slider_measurements.decoded

    def counted(*arguments):
        count[0] += 1
        return read(*arguments)

    monkeypatch.setattr(slider_measurements, "decoded", counted)
    return count


def random_message(source):
    others = [f"{source.choice(TEXTS)}_{index}" for index in range(source.randrange(4))]
    message = JointState(name=[*NAMES, *others])
    source.shuffle(message.name)
    message.header.frame_id = source.choice(TEXTS)
    if source.random() < 0.1:
        message.name = others
    has_velocities, has_efforts = source.random() < 0.7, source.random() < 0.3
    fill(message, source, has_velocities, has_efforts)
    return message


def fill(message, source, has_velocities, has_efforts):
    message.header.stamp.sec = source.randrange(-(2**31), 2**31)
    message.header.stamp.nanosec = source.randrange(2**32)

    def numbers():
        return [source.choice((source.uniform(-9, 9), math.inf, 0.0)) for _ in message.name]

    message.position = numbers()
    message.velocity = numbers() if has_velocities else []
    if message.velocity and source.random() < 0.1:
        message.velocity[source.randrange(len(message.name))] = math.nan
    message.effort = numbers() if has_efforts else []


def written(message, source):
    """Return the bytes of a message, with anything in the bytes that have no meaning."""
    data = bytearray(serialize_message(message))
    mask = slider_measurements._head_mask(message) if message.position else b""
    for offset, meaning in enumerate(mask, slider_measurements.STAMP_END):
        if not meaning:
            data[offset] = source.randrange(256)
    return bytes(data)


def expected(message):
    return slider_measurements.reading_of(message, NAMES)


@pytest.mark.parametrize("seed", range(40))
def test_any_messages_are_read_as_part_by_part(seed, slow_reads):
    source = random.Random(seed)
    reader = SliderMeasurements(NAMES)
    messages = [random_message(source) for _ in range(3)]
    for count in range(60):
        message = source.choice(messages)
        fill(message, source, bool(message.velocity), bool(message.effort))
        assert reader.read(written(message, source)) == expected(message)
        if count == 30:
            before = slow_reads[0]
    lengths = {len(serialize_message(message)) for message in messages}
    # Messages of one length push each other out, unless they begin alike.
    if len(lengths) == len(messages) and all(message.name for message in messages):
        assert slow_reads[0] == before


def test_messages_of_the_same_length_are_told_apart():
    reader = SliderMeasurements(NAMES)
    kinds = (
        JointState(name=NAMES, position=[1, 2, 3], velocity=[4, 5, 6]),
        JointState(name=NAMES, position=[1, 2, 3], effort=[4, 5, 6]),
        JointState(name=NAMES[::-1], position=[1, 2, 3], velocity=[4, 5, 6]),
        JointState(name=["slider_4", *NAMES[1:]], position=[1, 2, 3], velocity=[4, 5, 6]),
    )
    for _ in range(2):
        for kind in kinds[:3]:
            assert reader.read(serialize_message(kind)) == expected(kind)
        with pytest.raises(RefusedMessageError, match="lacks slider_1"):
            reader.read(serialize_message(kinds[3]))


def test_a_message_that_is_cut_off_is_an_error_and_not_a_reading():
    reader = SliderMeasurements(NAMES)
    message = JointState(name=NAMES, position=[1, 2, 3], velocity=[4, 5, 6])
    data = serialize_message(message)
    assert reader.read(data) == expected(message)
    for end in (0, 3, 11, 60, len(data) - 30):
        with pytest.raises(RefusedMessageError):
            reader.read(data[:end])
    assert reader.read(data) == expected(message)


def test_publishers_without_end_take_no_memory():
    reader = SliderMeasurements(NAMES)
    for count in range(1, 3 * MOST_LAYOUTS):
        names = [*NAMES, *(f"other_{index}" for index in range(count))]
        message = JointState(name=names, position=[float(index) for index in range(len(names))])
        for _ in range(2):
            assert reader.read(serialize_message(message)) == expected(message)
    assert len(reader._layouts) == MOST_LAYOUTS


@pytest.mark.parametrize("seed", range(5))
def test_offsets_are_added_in_both_ways_of_reading(seed, slow_reads):
    source = random.Random(seed)
    offsets = tuple(source.uniform(-0.01, 0.01) for _ in NAMES)
    plain, reader = SliderMeasurements(NAMES), SliderMeasurements(NAMES, offsets)
    for _ in range(3):
        positions = [source.uniform(0.3, 0.9) for _ in NAMES]
        data = serialize_message(JointState(name=NAMES, position=positions, velocity=[1, 2, 3]))
        reading = reader.read(data)
        expected_heights = tuple(map(sum, zip(plain.read(data).heights, offsets)))
        assert reading.heights == expected_heights
        assert reading.velocities == (1.0, 2.0, 3.0)
    # Of each reader the first message is read part by part, the others are not.
    assert slow_reads[0] == 2


def test_bytes_of_any_kind_are_read_or_refused_and_never_fail_otherwise(capfd):
    source = random.Random(7)
    reader = SliderMeasurements(NAMES)
    for _ in range(300):
        whole = serialize_message(random_message(source))
        with suppress(KinematicsError):
            reader.read(whole)
        for _ in range(20):
            data = bytearray(whole[: source.choice((len(whole), source.randrange(len(whole))))])
            for _ in range(source.randrange(4) if data else 0):
                data[source.randrange(len(data))] = source.choice((0, 1, 127, 255, 65))
            with suppress(KinematicsError):
                reader.read(bytes(data))
    # Nothing but our own log may tell of them, as that is bounded.
    assert capfd.readouterr().err == ""


def read(message):
    """Return heights and velocities of the sliders."""
    reading = slider_measurements.reading_of(message, NAMES)
    return None if reading is None else reading[:2]


def test_a_slider_that_is_named_twice_has_no_height():
    message = JointState(name=[*NAMES, NAMES[1]], position=[0.6, 0.6, 0.6, 0.9])
    with pytest.raises(RefusedMessageError, match=f"names {NAMES[1]} 2 times"):
        read(message)


@settings(derandomize=True, database=None)
@given(st.permutations([*NAMES, "gripper", "slider_10"]))
def test_sliders_are_found_by_name_in_any_order(names):
    heights = dict(zip([*NAMES, "gripper", "slider_10"], (1.0, 2.0, 3.0, 4.0, 5.0)))
    message = JointState(
        name=names,
        position=[heights[name] for name in names],
        velocity=[-heights[name] for name in names],
    )
    assert read(message) == ((1.0, 2.0, 3.0), (-1.0, -2.0, -3.0))


def test_joints_of_others_are_not_ours():
    assert read(JointState(name=["a", "b"], position=[1.0, 2.0])) is None
    assert read(JointState()) is None


def test_numbers_that_fade_out_come_to_zero():
    message = JointState(name=NAMES, position=[5e-324, 2.0, -1e-310], velocity=[0.0, 1e-320, 1.0])
    for _ in range(2):
        assert read(message) == ((0.0, 2.0, 0.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize("velocities", [[], [0.1, math.nan, 0.1]])
def test_velocities_may_be_missing(velocities):
    message = JointState(name=NAMES, position=[1.0, 2.0, 3.0], velocity=velocities)
    assert read(message) == ((1.0, 2.0, 3.0), None)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (JointState(name=NAMES[:2], position=[1.0, 2.0]), "lacks slider_3"),
        (JointState(name=NAMES, position=[1.0, 2.0]), "3 names, but 2 positions"),
        (JointState(name=NAMES), "3 names, but 0 positions"),
        (JointState(position=[1.0] * 3), "3 positions, but no names"),
        (JointState(name=NAMES, position=[1.0] * 3, velocity=[1.0]), "3 names, but 1 velocities"),
    ],
)
def test_incomplete_joint_states_are_refused_each_time(message, text):
    for _ in range(2):
        with pytest.raises(RefusedMessageError, match=text):
            read(message)


@settings(derandomize=True, database=None)
@given(
    st.lists(st.sampled_from([*NAMES, "", "x"]), max_size=6),
    st.lists(st.floats(), max_size=6),
    st.lists(st.floats(), max_size=6),
)
def test_any_joint_state_is_read_or_refused(names, positions, velocities):
    message = JointState(name=names, position=positions, velocity=velocities)
    try:
        reading = read(message)
    except RefusedMessageError:
        return
    assert reading is None or len(reading[0]) == 3
