"""The simulator and the recorder, for a mine that publishes its own terrain and sources."""

# ruff: noqa: I001 - ruff takes this folder for the package `launch`
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Arguments: params_file, record_to."""
    params_file = PathJoinSubstitution([FindPackageShare("rpf3d"), "config", "rpf3d.yaml"])
    given = LaunchConfiguration("params_file")
    return LaunchDescription(
        [
            DeclareLaunchArgument("params_file", default_value=params_file, description="parameters of the nodes"),
            DeclareLaunchArgument("record_to", default_value="rpf3d.rrd", description="the recording to write"),
            Node(package="rpf3d", executable="rpf3d_simulator", parameters=[given], output="screen"),
            Node(
                package="rpf3d",
                executable="rpf3d_recorder",
                parameters=[given, {"file": LaunchConfiguration("record_to")}],
                output="screen",
            ),
        ]
    )
