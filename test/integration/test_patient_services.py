"""Answers that the middleware drops at first reach their clients all the same."""

from __future__ import annotations

import warnings

import pytest
from std_srvs.srv import Trigger

from tri_glide_kinematics.nodes import patient_services
from tri_glide_kinematics.nodes.patient_services import PatientServices

DROPPED = "failed to send response (timeout): client will not receive response"


@pytest.fixture
def answer_again(client):
    """Serve ``~/name`` with a middleware that drops the first answers, and return a caller."""

    def serve(name, drops, **options):
        send_attempts = []
        create_service = client.node.create_service

        def create(kind, service_name, callback):
            service = create_service(kind, service_name, callback)
            send = service.send_response

            def drop_or_send(response, header):
                send_attempts.append(response)
                if len(send_attempts) <= drops:
                    warnings.warn(DROPPED, RuntimeWarning, stacklevel=1)
                else:
                    send(response, header)

            service.send_response = drop_or_send
            return service

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(client.node, "create_service", create)
            PatientServices(client.node, **options).create(Trigger, f"~/{name}", greet)
        caller = client.node.create_client(Trigger, f"~/{name}")
        client.wait_for(caller.service_is_ready, name)
        return caller, send_attempts

    return serve


def greet(request, response):
    response.message = "hello"
    return response


def test_answers_that_are_dropped_at_first_arrive(client, answer_again, recwarn):
    caller, attempts = answer_again("greet", drops=4)
    futures = [caller.call_async(Trigger.Request()) for _ in range(3)]
    client.wait_for(lambda: all(future.done() for future in futures), "all answers")
    assert [future.result().message for future in futures] == ["hello"] * 3
    assert len(attempts) == 4 + 3
    assert not recwarn.list


def test_an_answer_that_nobody_takes_is_given_up(client, answer_again, monkeypatch):
    monkeypatch.setattr(patient_services, "GIVE_UP_AFTER", 0.0)
    caller, attempts = answer_again("greet", drops=2)
    lost = caller.call_async(Trigger.Request())
    client.wait_for(lambda: len(attempts) == 2, "the second attempt")
    answered = caller.call_async(Trigger.Request())
    client.wait_for(answered.done, "the answer of the next request")
    assert len(attempts) == 3
    assert not lost.done()


def test_too_many_answers_displace_the_oldest(client, answer_again, monkeypatch):
    monkeypatch.setattr(patient_services, "MAX_WAITING", 2)
    monkeypatch.setattr(patient_services, "RETRY_PERIOD", 2.0)
    caller, _ = answer_again("greet", drops=3)
    lost, *others = [caller.call_async(Trigger.Request()) for _ in range(3)]
    client.wait_for(lambda: all(future.done() for future in others), "the two last answers")
    assert not lost.done()


def test_nothing_is_sent_again_while_there_is_no_time_for_it(client, answer_again):
    asked = []

    def after_five_times():
        asked.append(None)
        return len(asked) > 5

    caller, attempts = answer_again("greet", drops=1, may_wait=after_five_times)
    future = caller.call_async(Trigger.Request())
    client.wait_for(lambda: len(asked) == 5, "five occasions")
    assert len(attempts) == 1
    client.wait_for(future.done, "the answer")
