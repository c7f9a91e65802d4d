"""Take the picture of the demo's shift for the README: a viewer without a screen shows one second of its recording.

    python docs/pictures/shift.py out/demo-ros/demo.rrd docs/pictures/shift.png [second]

Needs a Vulkan driver, in software if there is no other: `apt install mesa-vulkan-drivers libvulkan1`.
"""

import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image
from rerun.experimental import ViewerClient

from rpf3d_ros.demo.run import BEGINS_NS

SECOND = 158.0
"""Time in the shift that the picture shows (s): the ramp is evacuated."""
PORT = 19_877
RERUN = Path(sys.executable).parent / "rerun"
SIZE = (1280, 720)
"""Pixels of the picture."""
LOADING, DRAWING = 12.0, 6.0
"""Seconds that a software renderer needs to load the recording, and to draw it."""


def take(recording: Path, picture: Path, second: float) -> None:
    """Write the picture of a recording at a time of the shift (s)."""
    options = {"port": PORT, "headless": True, "hide_welcome_screen": True, "executable_path": str(RERUN)}
    with ViewerClient.spawn(**options) as viewer:
        viewer.open(str(recording.resolve()))
        time.sleep(LOADING)
        at = np.datetime64(BEGINS_NS, "ns") + np.timedelta64(round(second * 1e9), "ns")
        viewer.set_time("ros_time", timestamp=at, play_state="paused")
        time.sleep(DRAWING)
        viewer.save_screenshot(str(picture.resolve()))
        time.sleep(DRAWING)
    smaller = Image.open(picture).convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)
    smaller.quantize(256, Image.Quantize.FASTOCTREE).save(picture, optimize=True)


if __name__ == "__main__":
    take(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]) if len(sys.argv) > 3 else SECOND)
