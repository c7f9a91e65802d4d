"""Start the nodes of rpf3d.launch.py, and publish the demo scene in place of survey and radar."""

# ruff: noqa: I001 - ruff mistakes this folder for the package `launch`
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the launch description; its arguments are publish_scene, and the arguments of rpf3d.launch.py."""
    share = FindPackageShare("rpf3d")
    scene = PathJoinSubstitution([share, "config", "scenes", "demo.yaml"])
    everything = PythonLaunchDescriptionSource(PathJoinSubstitution([share, "launch", "rpf3d.launch.py"]))
    return LaunchDescription(
        [
            DeclareLaunchArgument("publish_scene", default_value=scene, description="the scene file to publish"),
            IncludeLaunchDescription(everything),  # uses publish_scene and all given arguments
        ]
    )
