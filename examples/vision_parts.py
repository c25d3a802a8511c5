#!/usr/bin/env python3
"""Passes on to pick_node what a camera tells as vision_msgs (needs ros-jazzy-vision-msgs).

python3 examples/vision_parts.py --ros-args -r detections:=/camera/detections
"""

from __future__ import annotations

import math
import sys
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException

from tri_glide_interfaces.msg import SeenPart, SeenParts


def main() -> int:
    """Pass on each picture with its stamp, which tells where the belt was."""
    from vision_msgs.msg import Detection3DArray

    rclpy.init()
    node = rclpy.create_node("vision_parts")
    publisher = node.create_publisher(SeenParts, "parts", 10)

    def tell(picture: Detection3DArray) -> None:
        message = SeenParts(header=picture.header)
        for seen in picture.detections:
            place, turn = seen.bbox.center.position, seen.bbox.center.orientation
            kinds = {one.hypothesis.score: one.hypothesis.class_id for one in seen.results}
            kind = kinds[max(kinds)] if kinds else ""
            angle = 2.0 * math.atan2(turn.z, turn.w)  # about z of the camera
            message.parts.append(SeenPart(id=seen.id, kind=kind, position=place, angle=angle))
        publisher.publish(message)

    node.create_subscription(Detection3DArray, "detections", tell, 10)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)
    return 0


if __name__ == "__main__":
    sys.exit(main())
