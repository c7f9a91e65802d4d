"""The simulator and the recorder, and a scene file in the place of the survey and the radar."""

# ruff: noqa: I001 - ruff takes this folder for the package `launch`
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Arguments: scene, params_file, record_to."""
    share = FindPackageShare("rpf3d")
    scene = PathJoinSubstitution([share, "config", "scenes", "demo.yaml"])
    params_file = PathJoinSubstitution([share, "config", "rpf3d.yaml"])
    both = PythonLaunchDescriptionSource(PathJoinSubstitution([share, "launch", "rpf3d.launch.py"]))
    return LaunchDescription(
        [
            DeclareLaunchArgument("scene", default_value=scene, description="the scene file to publish"),
            DeclareLaunchArgument("params_file", default_value=params_file, description="parameters of the nodes"),
            IncludeLaunchDescription(both),  # takes params_file and record_to from here
            Node(
                package="rpf3d",
                executable="rpf3d_scene_publisher",
                parameters=[LaunchConfiguration("params_file"), {"scene": LaunchConfiguration("scene")}],
                output="screen",
            ),
        ]
    )
