"""`rpf3d from-bag`: convert a bag of the nodes' topics into a recording, without ROS.

`rpf3d` finds this command by the entry point `rpf3d.commands`, because the core does not import the nodes.
"""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.screen import complaints, screen
from rpf3d_core.errors import InputError
from rpf3d_ros.recording.bag_sensors import HELP

SHOWN = 10
"""Number of refused messages that are printed one by one."""


def from_bag(
    bag: Annotated[Path, typer.Argument(help="Folder of a rosbag2 bag, or its .mcap or .db3 file.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="The recording (.rrd) to write.")],
    namespace: Annotated[str, typer.Option(help="Namespace of the topics in the bag.")] = "",
    map_frame: Annotated[str, typer.Option(help="Frame of the messages, as the nodes' parameter.")] = "map",
    survey_frame: Annotated[str, typer.Option(help="Frame of messages in survey coordinates.")] = "",
    map_origin: Annotated[
        tuple[float, float, float], typer.Option(help="Survey coordinates E, N, H of the map's origin (m).")
    ] = (0.0, 0.0, 0.0),
    mesh_frame: Annotated[str, typer.Option(help="Frame of terrain/mesh.")] = "map",
    source_topics: Annotated[str | None, typer.Option(help=HELP.format("poses"))] = None,
    source_cloud_topics: Annotated[str | None, typer.Option(help=HELP.format("clouds"))] = None,
    whole: Annotated[bool, typer.Option("--whole", help="Leave out no rock and no hazard map.")] = False,
) -> None:
    """Write the recording that the live recorder would have written from a bag's messages."""
    from rpf3d_ros.recording.from_bag import WHOLE, MapFrame, Thinning, convert, sensors_of, unread_of

    frame = MapFrame(name=map_frame, survey=survey_frame, origin=map_origin)
    sensors = sensors_of(bag, source_topics, source_cloud_topics)
    try:
        done = convert(bag, out, frame, mesh_frame, namespace, WHOLE if whole else Thinning(), sensors)
    except OSError as error:
        raise InputError(str(error)) from error
    for sentence in unread_of(bag, namespace, sensors):
        complaints.print(sentence, markup=False)
    for sentence in done.refused[:SHOWN]:
        complaints.print(f"refused: {sentence}", markup=False)
    if len(done.refused) > SHOWN:
        complaints.print(f"refused: {len(done.refused) - SHOWN} more", markup=False)
    counts = ", ".join(f"{topic} {count}" for topic, count in done.messages.items())
    screen.print(f"{out}: {sum(done.messages.values())} messages ({counts})", highlight=False, markup=False)
