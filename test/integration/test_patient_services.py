"""Answers wait for clients that are not discovered in full; the node that gives them does not."""

from std_srvs.srv import SetBool

from testing.calls import calls
from testing.client import UNFIT
from tri_glide_kinematics.ros.serving import PatientServices, patient_services


class Greeter:
    """Serves ``~/greet``; each answer has its number."""

    def __init__(self, client, unfit_node, **options):
        self.asked = 0
        self._client = client
        service = client.node.create_service(SetBool, "~/greet", self._greet)
        PatientServices(client.node, **options)
        self.caller = client.node.create_client(SetBool, "~/greet")
        client.wait_for(self.caller.service_is_ready, "greet")
        self.unfit = unfit_node.create_client(SetBool, service.service_name, qos_profile=UNFIT)

    def _greet(self, request, response):
        self.asked += 1
        response.message = f"hello {self.asked}"
        return response

    def ask_in_vain(self):
        """Ask as a client that is never connected in full, and wait until it was heard."""
        count = self.asked

        def heard():
            # Before the middleware knows of the service, a request goes nowhere.
            self.unfit.call_async(SetBool.Request())
            self._client.spin_once()
            return self.asked > count

        self._client.wait_for(heard, "the request")

    def ask(self):
        count = self.asked
        future = self.caller.call_async(SetBool.Request())
        self._client.wait_for(lambda: self.asked > count, "the request")
        return future


def answers_until(client, condition, what):
    """Wait for a condition and return how many answers were given to the middleware meanwhile."""
    return calls(lambda: client.wait_for(condition, what))["service_send_response"]


def answers_in_looks(client, looks=20):
    """Return how many answers were given while the node looks at all of its work so many times."""
    seen = []
    timer = client.node.create_timer(0.02, lambda: seen.append(None))
    count = answers_until(client, lambda: len(seen) >= looks, "turns of the node")
    client.node.destroy_timer(timer)
    return count


def never():
    return False


def test_a_client_that_is_not_connected_in_full_holds_nobody_up(client, unfit_node):
    greeter = Greeter(client, unfit_node, may_wait=never)
    greeter.ask_in_vain()
    for _ in range(3):
        greeter.unfit.call_async(SetBool.Request())
    # For each the middleware would wait for 100 ms.
    assert answers_until(client, lambda: greeter.asked >= 4, "the requests") == 0
    assert answers_in_looks(client) == 0


def test_kept_answers_arrive_once_all_clients_are_known(client, unfit_node, recwarn):
    greeter = Greeter(client, unfit_node, may_wait=never)
    greeter.ask_in_vain()
    futures = [greeter.ask() for _ in range(3)]
    assert answers_in_looks(client) == 0
    assert not any(future.done() for future in futures)
    unfit_node.destroy_client(greeter.unfit)
    given = answers_until(client, lambda: all(each.done() for each in futures), "all answers")
    assert given == greeter.asked
    last = greeter.asked
    texts = [future.result().message for future in futures]
    assert texts == [f"hello {number}" for number in range(last - 2, last + 1)]
    assert not recwarn.list


def test_after_some_time_an_answer_is_sent_when_that_does_no_harm(client, unfit_node, monkeypatch):
    monkeypatch.setattr(patient_services, "PATIENCE", 0.2)
    asked = []

    def after_five_times():
        asked.append(None)
        return len(asked) > 5

    greeter = Greeter(client, unfit_node, may_wait=after_five_times)
    greeter.ask_in_vain()
    future = greeter.ask()
    client.wait_for(lambda: len(asked) == 5, "five occasions")
    assert not future.done()
    client.wait_for(future.done, "the answer")


def test_requests_that_come_in_fast_do_not_put_off_kept_answers(client, unfit_node, monkeypatch):
    monkeypatch.setattr(patient_services, "PATIENCE", 0.2)
    greeter = Greeter(client, unfit_node)
    greeter.ask_in_vain()
    future = greeter.ask()

    # Faster than kept answers are looked at.
    flood = client.node.create_timer(0.01, lambda: greeter.unfit.call_async(SetBool.Request()))
    client.wait_for(future.done, "the answer")
    flood.cancel()


def test_an_answer_that_nobody_takes_is_given_up(client, unfit_node, monkeypatch, capfd):
    monkeypatch.setattr(patient_services, "GIVE_UP_AFTER", 0.2)
    greeter = Greeter(client, unfit_node, may_wait=never)
    greeter.ask_in_vain()
    output = []

    def given_up():
        output.append(capfd.readouterr().err)
        return "/greet: gave up an answer" in "".join(output)

    client.wait_for(given_up, "a warning")
    unfit_node.destroy_client(greeter.unfit)
    future = greeter.ask()
    client.wait_for(future.done, "the answer of the next request")


def test_too_many_answers_displace_the_oldest(client, unfit_node, monkeypatch):
    monkeypatch.setattr(patient_services, "MAX_WAITING", 2)
    greeter = Greeter(client, unfit_node, may_wait=never)
    greeter.ask_in_vain()
    lost, *others = [greeter.ask() for _ in range(3)]
    unfit_node.destroy_client(greeter.unfit)
    client.wait_for(lambda: all(future.done() for future in others), "the two last answers")
    assert not lost.done()
