"""The command ``calibration_demo``: a simulated machine is wrong, and is calibrated.

The nodes believe the drawing; the simulator is another machine. The plate is probed, three
distances are measured, the machine is calibrated, and ik_node is started again with the result.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from pathlib import Path

import numpy as np

from tri_glide_interfaces.srv import SaveMeasurements, SolveCalibration
from tri_glide_kinematics.calibration.fit import MachineParameters, Priors, load_measurements
from tri_glide_kinematics.calibration.session import report, save_parameters, solved
from tri_glide_kinematics.demo.calibration.client import CalibrationClient
from tri_glide_kinematics.demo.calibration.course import PLATE, judge, measure_distances, probe
from tri_glide_kinematics.demo.calibration.verdict import Verdict, table
from tri_glide_kinematics.demo.command import PATIENCE, ros_that_ctrl_c_ends
from tri_glide_kinematics.demo.report import say
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.starting import (
    COMPUTER,
    NodeProcesses,
    choose_transport,
    default_parameter_file,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

NOMINAL = MachineParameters(DEFAULT_GEOMETRY)
# How far machines are from their drawing, and what is assumed of this one (standard deviations).
USUAL_ERRORS = Priors(anchors=5e-4, arm_lengths=3e-4, height_offsets=1e-3)


def wrong_machine(seed: int) -> MachineParameters:
    """Return one of many machines that were all built to the drawing of the default one."""
    deviations = USUAL_ERRORS.deviations()
    change = deviations * np.random.default_rng(seed).standard_normal(len(deviations))
    return MachineParameters.from_vector(NOMINAL.vector + change)


MEASUREMENTS, TRUTH, CALIBRATED = "measurements.yaml", "true_machine.yaml", "calibrated.yaml"
# A busy computer may send twists late [s].
TWIST_TIMEOUT = 1.0
# The simulator looks at its switch 500 times a second [s].
CONTACT_DELAY = 0.001
# The fewest touches that tell of the plate's whole area, and all places there are.
FEWEST, MOST = 7, 13


def demonstrate(folder: Path, seed: int, touches: int) -> int:
    """Start the nodes, calibrate, judge, and return the exit code."""
    folder.mkdir(parents=True, exist_ok=True)
    truth = wrong_machine(seed)
    save_parameters(folder / TRUTH, truth)
    namespace = f"/tri_glide_demo_{os.getpid()}"

    def arguments(*files: Path) -> list[str]:
        found = ["-r", f"__ns:={namespace}", "--log-level", "WARN"]
        for file in (default_parameter_file(), *files):
            found += ["--params-file", str(file)]
        return [*found, *PATIENCE, "-p", f"twist_timeout:={TWIST_TIMEOUT}"]

    say(f"a machine that is wrong by {USUAL_ERRORS}")
    with NodeProcesses() as processes:
        say("starting simulator_node with that machine, the other nodes with its drawing")
        plate = ["-p", f"plate_height:={PLATE}"]
        files = ["-p", f"folder:={folder.resolve()}"]
        processes.start("simulator_node", [*arguments(folder / TRUTH), *plate])
        processes.start("calibration_node", [*arguments(), *plate, *files, *_assumed()])
        believing = processes.start("ik_node", arguments())
        with ros_that_ctrl_c_ends():
            client = CalibrationClient(namespace)
            client.wait_for_machine()
            say("looking where it truly goes")
            before = judge(client)
            probe(client, touches, NOMINAL)
            measure_distances(client, np.random.default_rng(seed))
            measurements, calibrated = (folder / name for name in (MEASUREMENTS, CALIBRATED))
            client.ask(SaveMeasurements, "save", SaveMeasurements.Request(file=MEASUREMENTS))
            request = SolveCalibration.Request(parameter_file=CALIBRATED)
            client.ask(SolveCalibration, "solve", request)
            say("starting ik_node again, with what was found out")
            believing.send_signal(signal.SIGINT)
            believing.wait()
            client.wait_until_gone()
            processes.start("ik_node", arguments(calibrated))
            client.wait_for_machine()
            after = judge(client)
    calibration = solved(load_measurements(measurements))
    verdict = Verdict.of(before, after, calibration)
    print(f"\n{report(calibration)}\n\n{table(verdict)}\n")
    # Drawing is imported late: it takes as long as starting the nodes.
    from tri_glide_kinematics.demo.calibration.picture import save_verdict

    say(f"picture: {save_verdict(folder, after.targets, verdict)}")
    say(f"measurements: {measurements}; to look at them: calibrate {measurements}")
    say("as right as predicted" if verdict.is_good else "FAILED: not as right as predicted")
    return 0 if verdict.is_good else 1


def _assumed() -> list[str]:
    """Return the parameters that say how wrong the machine may be, and how late its switch is."""
    values = {
        "prior_anchors": USUAL_ERRORS.anchors,
        "prior_arm_lengths": USUAL_ERRORS.arm_lengths,
        "prior_height_offsets": USUAL_ERRORS.height_offsets,
        "contact_delay": CONTACT_DELAY,
    }
    return [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]


def main() -> int:
    """Run the demonstration from the command line."""
    parser = argparse.ArgumentParser(prog="calibration_demo", description=__doc__)
    parser.add_argument(
        "--output", type=Path, default=Path("out"), help="folder of all files (default: out)"
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="which of many wrong machines (default: 1)"
    )
    parser.add_argument(
        "--touches",
        type=int,
        choices=range(FEWEST, MOST + 1),
        default=MOST,
        metavar="N",
        help=f"how many places are probed, {FEWEST} to {MOST} (default: {MOST})",
    )
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        # For this process and the nodes that it starts.
        say(choose_transport(COMPUTER).text)
        return demonstrate(options.output, options.seed, options.touches)
    except KeyboardInterrupt:
        say("interrupted; all nodes are stopped")
        return 128 + signal.SIGINT
    except (KinematicsError, OSError) as error:
        print(f"calibration_demo: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
