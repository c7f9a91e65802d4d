"""The simulator and, where asked for, the recorder and a scene in the place of the survey and the radar.

The simulator is a lifecycle node that configures and activates itself; `autostart:=false` leaves that to a manager.
"""

# ruff: noqa: I001 - ruff takes this folder for the package `launch`
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import (
    EqualsSubstitution,
    IfElseSubstitution,
    LaunchConfiguration,
    NotEqualsSubstitution,
    PathJoinSubstitution,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """All arguments are declared below with what they mean."""
    config = [FindPackageShare("rpf3d"), "config"]
    params_file = IfElseSubstitution(
        EqualsSubstitution(LaunchConfiguration("scene"), ""),
        if_value=PathJoinSubstitution([*config, "rpf3d.yaml"]),
        else_value=PathJoinSubstitution([*config, "rpf3d_scene.yaml"]),  # the one that sets no key of a scene
    )
    given = LaunchConfiguration("params_file")
    frames = {
        "map_frame": ParameterValue(LaunchConfiguration("map_frame"), value_type=str),
        "survey_frame": ParameterValue(LaunchConfiguration("survey_frame"), value_type=str),
    }
    simulator = {
        "scene": ParameterValue(LaunchConfiguration("scene"), value_type=str),
        "site_file": ParameterValue(LaunchConfiguration("site_file"), value_type=str),
        "autostart": ParameterValue(LaunchConfiguration("autostart"), value_type=bool),
    }
    recorder = {"file": ParameterValue(LaunchConfiguration("record_to"), value_type=str)}
    publisher = {"scene": ParameterValue(LaunchConfiguration("publish_scene"), value_type=str)}
    return LaunchDescription(
        [
            DeclareLaunchArgument("scene", default_value="", description="scene file for the simulator; empty: none"),
            DeclareLaunchArgument("params_file", default_value=params_file, description="parameters of the nodes"),
            DeclareLaunchArgument("site_file", default_value="", description="areas and thresholds; empty: no alerts"),
            DeclareLaunchArgument("map_frame", default_value="map", description="frame of every output"),
            DeclareLaunchArgument("survey_frame", default_value="", description="frame that map_origin shifts"),
            DeclareLaunchArgument("autostart", default_value="true", description="configure and activate at once"),
            DeclareLaunchArgument("record", default_value="true", description="whether to run the recorder"),
            DeclareLaunchArgument("record_to", default_value="rpf3d.rrd", description="the recording to write"),
            DeclareLaunchArgument("publish_scene", default_value="", description="scene file to publish; empty: none"),
            DeclareLaunchArgument("discovery_range", default_value="LOCALHOST", description="or SUBNET"),
            SetEnvironmentVariable("ROS_AUTOMATIC_DISCOVERY_RANGE", LaunchConfiguration("discovery_range")),
            Node(
                package="rpf3d", executable="rpf3d_simulator", parameters=[given, frames, simulator], output="screen",
            ),
            Node(
                package="rpf3d", executable="rpf3d_recorder", parameters=[given, frames, recorder], output="screen",
                condition=IfCondition(LaunchConfiguration("record")),
            ),
            Node(
                package="rpf3d", executable="rpf3d_scene_publisher", parameters=[given, frames, publisher],
                output="screen", condition=IfCondition(NotEqualsSubstitution(LaunchConfiguration("publish_scene"), "")),
            ),
        ]
    )  # fmt: skip
