"""The loop of a node: punctual, never held up, and it hears of everything, whatever happens."""

import itertools
import math
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from joined_domain import joined_domain
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from testing.domain import own_context
from testing.waiting import wait_until
from tri_glide_kinematics.ros.loop import Cycle, CycleLoop, UrgentInputs

pytestmark = pytest.mark.nodes

PERIOD = 0.005  # s
BOUND = 60.0  # s, for what takes a fraction of this
LONG = 3600.0  # s: a period that no test waits for
DEPTH = 10
NUMBERS = itertools.count()


class EndOfTest(Exception):  # noqa: N818 - it is none
    """Ends a loop from within."""


@pytest.fixture(scope="module")
def domain():
    with joined_domain() as context:
        yield context


@pytest.fixture
def context(domain):
    """Return a context that a test may shut down."""
    with own_context() as context:
        yield context


@pytest.fixture
def node(context):
    node = Node("cycling", namespace=f"/cycle_loop_{next(NUMBERS)}", context=context)
    yield node
    node.destroy_node()


@pytest.fixture
def run(node):
    """Return a function that runs a loop until a condition holds, and gives the errors survived."""
    loops = []

    def run(until, *urgent, period=PERIOD, step=lambda: None, **more):
        errors = []
        end = time.monotonic() + BOUND

        def survive(error):
            if isinstance(error, (EndOfTest, TimeoutError)):
                raise error
            errors.append(error)

        def step_or_end():
            if until():
                raise EndOfTest
            if time.monotonic() > end:
                raise TimeoutError("in vain")
            step()

        loop = CycleLoop(node, Cycle(urgent, period, step_or_end, **more), survive)
        loops.append(loop)
        with pytest.raises(EndOfTest):
            loop.spin()
        return errors

    yield run
    for loop in loops:
        loop.close()


@pytest.fixture
def numbers(node):
    """Return what makes a subscription of numbers, and one that publishes to all of them."""
    publisher = node.create_publisher(Int32, "numbers", QoSProfile(depth=1000))

    count = 0

    def subscription(callback):
        nonlocal count
        made = node.create_subscription(Int32, "numbers", callback, DEPTH)
        count += 1
        wait_until(lambda: publisher.get_subscription_count() >= count, "a listener")
        return made

    return subscription, lambda number: publisher.publish(Int32(data=number))


class Steps:
    """Notes when each cycle came."""

    def __init__(self, act=lambda count: None):
        self.times = []
        self._act = act

    def __call__(self):
        self.times.append(time.monotonic())
        self._act(len(self.times))

    def reach(self, count):
        return lambda: len(self.times) >= count


def occupy(duration):
    """Keep the caller busy."""
    end = time.monotonic() + duration
    while time.monotonic() < end:
        pass


def shortest(times, count):
    """Return the shortest time that ``count`` in a row took [s]: a computer is not always busy."""
    return min((last - first for first, last in zip(times, times[count:])), default=math.inf)


def assert_never_early(times, begin, period=PERIOD):
    for index, moment in enumerate(times):
        assert moment >= begin + index * period - 1e-6


def test_no_cycle_comes_early_and_none_is_left_out(run):
    steps = Steps()
    begin = time.monotonic()

    def none_left_out():
        return len(steps.times) >= 200 and shortest(steps.times, 10) < 10.5 * PERIOD

    assert run(none_left_out, step=steps) == []
    assert_never_early(steps.times, begin)


def test_after_a_stall_no_cycle_is_made_up_for(run):
    stall = 20
    steps = Steps(lambda count: occupy(stall * PERIOD) if count == 10 else None)
    begin = time.monotonic()
    run(steps.reach(60), step=steps)
    assert_never_early(steps.times[:10], begin)
    assert_never_early(steps.times[10:], begin + (9 + stall) * PERIOD)


def test_signals_do_not_shorten_the_sleep(run):
    heard = []
    before = signal.signal(signal.SIGALRM, lambda *_: heard.append(None))
    signal.setitimer(signal.ITIMER_REAL, 0.3 * PERIOD, 0.3 * PERIOD)
    try:
        steps = Steps()
        begin = time.monotonic()
        run(lambda: len(steps.times) >= 100 and len(heard) >= 100, step=steps)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert_never_early(steps.times, begin)


def test_messages_are_handled_in_order_and_none_is_lost(run, numbers):
    subscription, publish = numbers
    received = []

    def publish_some(count):
        if count <= 50:
            for index in range(4):
                publish(4 * count + index)

    made = subscription(lambda message: received.append(message.data))
    run(lambda: len(received) == 200, made, step=Steps(publish_some))
    assert received == list(range(4, 204))


def test_what_may_come_early_is_handled_in_the_sleep(run, numbers):
    subscription, publish = numbers
    period = 0.4
    sent, order = [], []
    soon, late = [[], []], [[], []]

    def step():
        # What comes in while a first one is handled waits for the next cycle.
        for number in range(2):
            publish(number)
        sent.append(time.monotonic())

    def handle(message):
        delay = time.monotonic() - sent[-1]
        order.append(message.data)
        (soon if delay < 0.5 * period else late)[message.data].append(delay)

    made = subscription(handle)
    # On a busy computer a message may come late in the sleep.
    run(
        lambda: len(soon[0]) >= 3 and len(late[1]) >= 3,
        made,
        period=period,
        step=step,
        early=(made,),
    )
    assert order[:6] == [0, 1] * 3


def test_what_is_slow_to_read_and_comes_just_before_a_step_is_read_behind_it(run, numbers):
    subscription, publish = numbers
    period, steps = 0.1, Steps()
    sent, steps_between = [], []

    def send_just_before_the_step(end):
        if len(sent) < len(steps.times):
            sent.append(len(steps.times))
            time.sleep(max(end - 0.005 - time.monotonic(), 0.0))
            publish(0)

    def read_slowly(_):
        steps_between.append(len(steps.times) - sent[-1])
        occupy(0.6 * period)

    made = subscription(read_slowly)
    run(
        lambda: steps_between.count(1) >= 3,
        made,
        period=period,
        step=steps,
        work=send_just_before_the_step,
        early=(made,),
    )
    # How long it takes is not known before the first one.
    assert steps_between[0] == 0


def test_timers_that_are_always_ready_leave_turns_to_others(run, node, numbers):
    subscription, publish = numbers
    timers, messages = [0, 0], []
    for index in range(2):

        def count(index=index):
            timers[index] += 1

        node.create_timer(1e-4, count)
    subscription(messages.append)

    def step():
        if len(messages) < 5:
            publish(0)

    run(lambda: len(messages) >= 5 and min(timers) >= 5, step=step)


def test_a_slow_callback_delays_a_cycle_by_itself_alone(run, numbers):
    subscription, publish = numbers
    handled = [[], []]
    in_this_cycle = []

    def slow(side):
        def callback(message):
            in_this_cycle.append(side)
            handled[side].append(message.data)
            occupy(2.0 * PERIOD)

        return callback

    urgent = [subscription(slow(side)) for side in (0, 1)]
    for number in range(DEPTH):
        publish(number)
    most = []

    def step():
        most.append((in_this_cycle.count(0), in_this_cycle.count(1)))
        in_this_cycle.clear()

    run(lambda: all(len(side) == DEPTH for side in handled), *urgent, step=step)
    # One that is slow does not keep another one from its turn.
    assert max(most) == (1, 1)
    assert handled == [list(range(DEPTH))] * 2


def test_a_flood_neither_holds_a_cycle_nor_starves_anything(run, node, numbers):
    subscription, publish = numbers
    in_this_cycle = [0]
    most = [0]
    turns = []
    others = []

    def again(message):
        in_this_cycle[0] += 1
        # More than there is place for: the queue is always full.
        for _ in range(3):
            publish(0)

    def step(_):
        most[0] = max(most[0], in_this_cycle[0])
        in_this_cycle[0] = 0

    node.create_timer(0.02, lambda: turns.append(None))
    quiet = node.create_subscription(Int32, "quiet", others.append, DEPTH)
    to_quiet = node.create_publisher(Int32, "quiet", 1)
    flooded = subscription(again)
    for _ in range(DEPTH):
        publish(0)
    steps = Steps(step)

    def until():
        if not others:
            to_quiet.publish(Int32())
        return len(steps.times) >= 100 and len(turns) >= 5 and others

    assert run(until, flooded, quiet, step=steps) == []
    assert 1 < most[0] <= DEPTH


def test_what_is_not_urgent_delays_a_cycle_by_one_callback(run, node):
    in_this_cycle = [0]
    calls = []
    most = []

    def slow(index):
        in_this_cycle[0] += 1
        calls.append(index)
        occupy(2.0 * PERIOD)

    for index in range(4):
        node.create_timer(0.01, lambda index=index: slow(index))

    def step():
        most.append(in_this_cycle[0])
        in_this_cycle[0] = 0

    run(lambda: set(calls) == set(range(4)), step=step)
    assert max(most) == 1


def test_many_that_are_not_urgent_do_not_wait_20_ms_each(run, node, numbers):
    count, handled, steps = 20, [], Steps()
    for _ in range(count):
        node.create_timer(0.2, lambda: handled.append(len(steps.times)))
    # So many cycles at most; on a busy computer, in one of the rounds.
    run(lambda: shortest(handled, count - 1) < count * 0.5 * 0.02 / PERIOD, step=steps)

    subscription, publish = numbers
    sent = 0
    handled.clear()
    subscription(lambda _: handled.append(len(steps.times)))

    def messages_do_not():
        nonlocal sent
        if len(handled) >= sent:
            sent += DEPTH
            for _ in range(DEPTH):
                publish(0)
        return shortest(handled, DEPTH - 1) < DEPTH * 0.5 * 0.02 / PERIOD

    run(messages_do_not, step=steps)


def test_what_a_node_takes_by_itself_is_left_to_it(run, node, numbers):
    subscription, publish = numbers
    own, steps = set(), Steps()
    left, handled = [], []

    def step():
        steps()
        if len(steps.times) == 5:
            # Made in a cycle, and nobody else's from then on.
            own.add(subscription(left.append))
            subscription(handled.append)
        if len(steps.times) >= 5:
            publish(len(steps.times))

    assert not run(lambda: len(handled) >= 50, step=step, own=own)
    assert not left
    inputs = UrgentInputs(own, lambda error: None)
    inputs.handle(time.monotonic() + BOUND)
    inputs.close()
    assert left


def test_a_clock_that_is_set_changes_nothing(run, node):
    node.set_parameters([Parameter("use_sim_time", value=True)])
    (clock_type,) = (
        subscription.msg_type
        for subscription in node.subscriptions
        if subscription.topic_name == "/clock"
    )
    publisher = node.create_publisher(clock_type, "/clock", 1)
    hours = itertools.cycle((10_000, 5_000, 1, 20_000))
    seen = set()

    def set_clock(count):
        if count % 10 == 0:
            message = clock_type()
            message.clock.sec = 3600 * next(hours)
            publisher.publish(message)
        seen.add(node.get_clock().now().nanoseconds // 3_600_000_000_000)

    steps = Steps(set_clock)
    begin = time.monotonic()
    run(lambda: seen >= {1, 5_000, 10_000, 20_000}, step=steps)
    assert_never_early(steps.times, begin)
    run(steps.reach(len(steps.times) + 20), step=steps)


def test_what_callbacks_raise_is_told_and_the_cycle_goes_on(run, node, numbers):
    subscription, publish = numbers

    calls = {}

    def failing(name):
        def callback(*_):
            calls[name] = True
            raise ValueError(name)

        return callback

    node.create_timer(0.01, failing("timer"))
    urgent = subscription(failing("message"))
    service = node.create_service(Trigger, "~/urgent", failing("request"))
    client = node.create_client(Trigger, "~/urgent")
    steps = Steps(lambda count: failing("step")() if count == 3 else publish(count))

    def until():
        if "request" not in calls and client.service_is_ready():
            client.call_async(Trigger.Request())
        return len(calls) == 4 and len(steps.times) > 20

    errors = run(until, urgent, service, step=steps)
    assert {str(error) for error in errors} == {"timer", "message", "request", "step"}


def test_what_is_not_survived_ends_the_loop(node):
    def step():
        raise ValueError("fatal")

    def survive(error):
        raise error

    loop = CycleLoop(node, Cycle((), PERIOD, step), survive)
    with pytest.raises(ValueError, match="fatal"):
        loop.spin()
    loop.close()


@pytest.mark.parametrize(
    ("period", "is_urgent"),
    # What is urgent waits for the next cycle.
    [(PERIOD, True), (PERIOD, False), (LONG, False), (None, True), (None, False)],
)
def test_services_are_served(run, node, period, is_urgent):
    service = node.create_service(Trigger, "~/called", lambda _, response: response)
    client = node.create_client(Trigger, "~/called")
    futures = []
    begin = time.monotonic()

    def look():
        if client.service_is_ready() and all(future.done() for future in futures):
            futures.append(client.call_async(Trigger.Request()))
        if len(futures) > 20:
            raise EndOfTest
        assert time.monotonic() < begin + BOUND

    node.create_timer(0.001, look)
    run(lambda: False, *((service,) if is_urgent else ()), period=period)


def test_a_node_without_a_period_reacts_to_each_message(run, node, numbers):
    subscription, publish = numbers
    received, turns, turns_at = [], [], []

    def answer(message):
        received.append(message.data)
        turns_at.append(len(turns))
        publish(message.data + 1)

    urgent = subscription(answer)
    publish(0)
    node.create_timer(0.001, lambda: turns.append(None))
    # Each is answered as soon as it is there: at the turns of all else two could be, at most.
    run(lambda: shortest(turns_at, 100) < 25, urgent, period=None)
    assert received == list(range(len(received)))


@pytest.mark.parametrize("period", [PERIOD, LONG, None])
def test_a_shutdown_from_another_thread_ends_the_loop(node, context, numbers, period):
    subscription, _ = numbers
    errors = []
    urgent = subscription(lambda message: None)
    loop = CycleLoop(node, Cycle((urgent,), period), errors.append)
    timer = threading.Timer(0.2, context.try_shutdown)
    begin = time.monotonic()
    timer.start()
    loop.spin()
    timer.join()
    assert time.monotonic() - begin < BOUND
    loop.close()


NODE_THAT_SLEEPS = """
import signal, rclpy
from rclpy.node import Node
from testing.domain import own_context
from tri_glide_kinematics.ros.loop import Cycle, CycleLoop

signal.signal(signal.SIGINT, lambda *_: None)
rclpy.init(args=[])
node = Node("sleeping")

def survive(error):
    if rclpy.ok():
        raise error

loop = CycleLoop(node, Cycle((), 3600.0, lambda: print("asleep", flush=True)), survive)
loop.spin()
loop.close()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_the_sleep_ends_the_loop(context, number):
    command = [sys.executable, "-c", NODE_THAT_SLEEPS]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=os.environ, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "asleep\n"
        process.send_signal(number)
        assert process.wait(BOUND) == 0


def test_work_is_told_until_when_it_has_time(run):
    steps = Steps()
    given = []

    def in_time():
        return [until for until, _, now in given if now < until]

    # A busy computer is late with others.
    run(
        lambda: len(in_time()) >= 25,
        step=steps,
        work=lambda until: given.append((until, len(steps.times), time.monotonic())),
    )
    assert [count for _, count, _ in given] == list(range(1, len(given) + 1))
    for (until, _, _), (later, _, _) in itertools.pairwise(given):
        cycles = (later - until) / PERIOD
        assert cycles == pytest.approx(round(cycles), abs=1e-6)
        assert cycles > 0.5
    assert all(until - now < PERIOD for until, _, now in given)
