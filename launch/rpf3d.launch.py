"""Start the simulator and, by arguments, the recorder, the scene publisher in place of survey and radar, and rviz2.

The simulator is a lifecycle node that configures and activates itself; with `autostart:=false` a lifecycle manager does
this. For an argument that is not given, the value of the parameter file applies.
"""

# ruff: noqa: I001 - ruff mistakes this folder for the package `launch`
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

OF_ALL = {"map_frame": str, "survey_frame": str, "use_sim_time": bool}
SIMULATOR = {"scene": str, "site_file": str, "decision_log": str, "store": str, "autostart": bool}
"""Launch arguments that set parameters of the same name, with their types: of all nodes, and of the simulator."""

PAUSE = 2.0
"""Time (s) between the end of a node and its next start."""


def generate_launch_description() -> LaunchDescription:
    """Return the launch description with all arguments; an empty argument counts as not given."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file", default_value="",
                description="parameter file of all nodes; empty: config/rpf3d.yaml, with scene config/rpf3d_scene.yaml",
            ),
            DeclareLaunchArgument("scene", default_value="", description="scene file of the simulator; empty: none"),
            DeclareLaunchArgument("site_file", default_value="", description="site file; empty: no alerts"),
            DeclareLaunchArgument(
                "decision_log", default_value="",
                description="folder of the decision log; empty: the folder decisions next to the site file",
            ),
            DeclareLaunchArgument("store", default_value="", description="folder of the last terrain; empty: none"),
            DeclareLaunchArgument("map_frame", default_value="", description="frame of all outputs"),
            DeclareLaunchArgument(
                "survey_frame", default_value="", description="frame in survey coordinates, which map_origin shifts"
            ),
            DeclareLaunchArgument(
                "autostart", default_value="",
                description="true: the simulator configures and activates itself; false: a lifecycle manager does this",
            ),
            DeclareLaunchArgument("namespace", default_value="", description="of all nodes, such as pit_a"),
            DeclareLaunchArgument("use_sim_time", default_value="", description="true: the time of /clock"),
            DeclareLaunchArgument("respawn", default_value="true", description="true: restart a node that ends"),
            DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn, error or fatal"),
            DeclareLaunchArgument("rviz", default_value="false", description="true: run rviz2 with rpf3d.rviz"),
            DeclareLaunchArgument("record", default_value="true", description="true: run the recorder"),
            DeclareLaunchArgument("record_to", default_value="rpf3d.rrd", description="file of the recording"),
            DeclareLaunchArgument("publish_scene", default_value="", description="scene file to publish; empty: none"),
            DeclareLaunchArgument("discovery_range", default_value="LOCALHOST", description="LOCALHOST or SUBNET"),
            SetEnvironmentVariable("ROS_AUTOMATIC_DISCOVERY_RANGE", LaunchConfiguration("discovery_range")),
            OpaqueFunction(function=_nodes),
        ]
    )  # fmt: skip


def _nodes(context: LaunchContext) -> list[Node]:
    """Return the nodes to start, each with the parameters that the user gave as launch arguments.

    Arguments that were not given are left out: their defaults would replace the values of the parameter file.
    """

    def said(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    def given(kinds: dict[str, type]) -> dict[str, ParameterValue]:
        return {name: ParameterValue(said(name), value_type=kind) for name, kind in kinds.items() if said(name)}

    def named(name: str, argument: str) -> dict[str, ParameterValue]:
        return {name: ParameterValue(said(argument), value_type=str)}

    def yes(argument: str) -> bool:
        if said(argument).lower() not in ("true", "false"):
            raise ValueError(f"{argument} is {said(argument)!r}; it must be true or false")
        return said(argument).lower() == "true"

    def node(program: str, own: dict[str, ParameterValue]) -> Node:
        own = {**given(OF_ALL), **own}
        return Node(
            package="rpf3d", executable=program, namespace=said("namespace"), output="screen",
            parameters=[file, *([own] if own else [])], ros_arguments=["--log-level", said("log_level")],
            respawn=yes("respawn"), respawn_delay=PAUSE,
        )  # fmt: skip

    shipped = "rpf3d_scene.yaml" if said("scene") else "rpf3d.yaml"  # rpf3d_scene.yaml sets no scene key
    file = said("params_file") or PathJoinSubstitution([FindPackageShare("rpf3d"), "config", shipped])
    nodes = [node("rpf3d_simulator", given(SIMULATOR))]
    if yes("record"):
        nodes.append(node("rpf3d_recorder", named("file", "record_to")))
    if said("publish_scene"):
        nodes.append(node("rpf3d_scene_publisher", named("scene", "publish_scene")))
    if yes("rviz"):
        view = PathJoinSubstitution([FindPackageShare("rpf3d"), "config", "rpf3d.rviz"])
        nodes.append(Node(package="rviz2", executable="rviz2", namespace=said("namespace"), arguments=["-d", view]))
    return nodes
