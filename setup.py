from glob import glob

from setuptools import find_packages, setup

PACKAGE = "tri_glide_kinematics"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Kinematics, motion and ROS 2 nodes for tri-glide delta robots",
    license="Apache-2.0",
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    package_data={PACKAGE: ["py.typed"], f"{PACKAGE}.panel": ["page.css", "page.js"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/config", glob("config/*")),
        (f"share/{PACKAGE}/launch", glob("launch/*.launch.py")),
        # Nodes and commands. A script made of an entry point takes 45 ms to find it, a tenth of the
        # start of a node.
        (f"lib/{PACKAGE}", glob("executables/*")),
    ],
    python_requires=">=3.10",
    install_requires=["numpy", "ruckig", "scipy"],
    extras_require={
        "figures": ["matplotlib", "pillow", "pyyaml", "tqdm"],
        "panel": ["pyyaml", "viser"],
        "recordings": ["mcap-ros2-support"],
        "test": ["catkin_pkg", "hypothesis", "pytest", "websockets"],
    },
    zip_safe=False,
)
