"""The command behind make panel: all nodes, patient ones, and none of them is left."""

import os
import re
import signal
import stat
import subprocess
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from rclpy.parameter_client import AsyncParameterClient

from testing.processes import TIMEOUT, processes_in, wait_for_end_of_processes_in
from tri_glide_kinematics.ros.starting import executable

pytest.importorskip("viser")

from testing.text_page import TextPage

NODES = {"simulator_node", "ik_node", "fk_node", "mechanism_node", "panel_node"}


class Command:
    """The command as a process."""

    def __init__(self, process: subprocess.Popen[bytes], log: Path, namespace: str) -> None:
        self.process, self._log = process, log
        self.namespace = namespace or f"/tri_glide_panel_{process.pid}"

    @property
    def output(self) -> str:
        return self._log.read_text()

    def pid_of(self, node: str) -> int:
        """Return the number of the process of a node."""
        running = processes_in(self.namespace).items()
        return next(pid for pid, words in running if any(w.endswith(f"/{node}") for w in words))

    def interrupt(self) -> int:
        """Press Ctrl-C, and return the exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(TIMEOUT)


@contextmanager
def command(folder: Path, *arguments: str, namespace: str = "") -> Iterator[Command]:
    """Run the command, with its token and its log in a ``folder``; in a ``namespace`` if given."""
    log = folder / "log"
    if namespace:
        arguments = (*arguments, "--namespace", namespace)
    with log.open("wb") as output:
        process = subprocess.Popen(
            [str(executable("panel")), *arguments],
            env={**os.environ, "XDG_STATE_HOME": str(folder / "state")},
            stdout=output,
            stderr=subprocess.STDOUT,
        )
    running = Command(process, log, namespace)
    try:
        yield running
    except BaseException:
        print(running.output)
        raise
    finally:
        if process.poll() is None:
            running.interrupt()
    wait_for_end_of_processes_in(running.namespace)


def test_a_simulated_machine_waits_longer_for_its_measurements_and_ends_with_the_command(
    client, tmp_path
):
    with command(tmp_path, "--port", "0") as panel:

        def nodes():
            found = client.node.get_node_names_and_namespaces()
            return {name for name, space in found if space == panel.namespace}

        client.wait_for(lambda: nodes() >= NODES, "all nodes")
        assert len(processes_in(panel.namespace)) == len(NODES)
        parameters = AsyncParameterClient(client.node, f"{panel.namespace}/ik_node")
        client.wait_for(parameters.services_are_ready, "the parameters")
        asked = parameters.get_parameters(["measured_timeout"])
        client.wait_for(asked.done, "the answer")
        assert asked.result().values[0].double_value == 2.0
        assert panel.interrupt() == 128 + signal.SIGINT


def test_a_node_that_dies_is_told_here_and_on_the_page_which_stays(client, tmp_path):
    with command(tmp_path, "--port", "0") as panel:
        client.wait_for(lambda: "the page: " in panel.output, "the page")
        (address,) = re.findall(r"the page: (\S+)", panel.output)
        file = tmp_path / "state" / "tri_glide_kinematics" / "panel_token"
        assert address.endswith(f"/?token={file.read_text().strip()}")
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        with closing(TextPage(address)) as page:

            def wait_for_words(words, seen_by=page):
                client.wait_for(lambda: words in seen_by.text, words)

            wait_for_words("ramps to rest")
            os.kill(panel.pid_of("ik_node"), signal.SIGKILL)
            wait_for_words("ik_node has ended: killed by SIGKILL (signal 9)")
            client.wait_for(lambda: "the page stays" in panel.output, "the news")
            assert "panel: ik_node has ended: killed by SIGKILL (signal 9)" in panel.output
            # A second one is told as well.
            os.kill(panel.pid_of("fk_node"), signal.SIGTERM)
            wait_for_words("fk_node has ended: exit code 0")
            # The page offers to start them again; a page without the controls gets nothing by it.
            (start,) = (each for each in page.buttons if each.startswith("Start again"))
            with closing(TextPage(address)) as other:
                wait_for_words("page 1 has the controls", other)
                other.click(start)
                wait_for_words("nothing done, as the controls are with page 1", other)
            assert "is started again" not in panel.output
            page.click(start)
            client.wait_for(lambda: panel.output.count("is started again") == 2, "the news")
            wait_for_words("ready idle")
            client.wait_for(lambda: start not in page.buttons, "no offer")
            # What is kept is found at the next start, which has another namespace.
            page.click("all")
            client.wait_for(file.with_name("work_zero_panel.yaml").is_file, "the work zero")
        assert panel.process.poll() is None
        assert panel.interrupt() == 1
    assert panel.output.rstrip().endswith("all nodes are stopped")


def test_without_a_page_it_ends_with_an_error_in_a_namespace_of_choice_too(client, tmp_path):
    with command(tmp_path, "--port", "0", namespace=f"{client.namespace}_chosen") as panel:
        client.wait_for(lambda: "the page: " in panel.output, "the page")
        os.kill(panel.pid_of("panel_node"), signal.SIGSEGV)
        assert panel.process.wait(TIMEOUT) == 1
    assert "panel: panel_node has ended: killed by SIGSEGV (signal 11)" in panel.output
    assert "| the page: http" in panel.output
