import sys
from glob import glob
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = "tri_glide_kinematics"

# colcon installs all. A wheel is for use without ROS: what would be nothing without it stays out.
for_ros = "bdist_wheel" not in sys.argv
left_out = [] if for_ros else [f"{PACKAGE}.{room}" for room in ("demo*", "panel*")]
files_for_ros = [
    ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
    (f"share/{PACKAGE}", ["package.xml"]),
    (f"share/{PACKAGE}/launch", glob("launch/*.launch.py")),
    # Nodes and commands. A script made of an entry point takes 45 ms to find it, a tenth of the
    # start of a node.
    (f"lib/{PACKAGE}", glob("executables/*")),
]

setup(
    name=PACKAGE,
    version=ElementTree.parse("package.xml").findtext("version"),
    description="Kinematics, motion and ROS 2 nodes for tri-glide delta robots",
    license="Apache-2.0",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"], exclude=left_out),
    package_data={PACKAGE: ["py.typed"], f"{PACKAGE}.panel": ["page.css", "page.js"]},
    data_files=[
        (f"share/{PACKAGE}/config", glob("config/*")),
        *(files_for_ros if for_ros else []),
    ],
    # All commands that need no ROS, each by its name.
    entry_points={"console_scripts": [f"tri-glide = {PACKAGE}.command_line:main"]},
    python_requires=">=3.10",
    install_requires=["numpy", "pyyaml", "ruckig", "scipy"],
    extras_require={
        "can": ["canopen", "python-can[serial]"],
        "pictures": ["matplotlib", "pillow", "tqdm"],
        "recordings": ["mcap-ros2-support"],
        "test": ["catkin_pkg", "hypothesis", "pytest", "websockets"],
    },
    zip_safe=False,
)
