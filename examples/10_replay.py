"""A replay in rerun.

`write_run` writes a recording of the rocks, `run.rrd`. The rerun viewer plays the recording over the terrain.
The script prints the command that opens the recording. With `--open`, the script opens the viewer, which needs a
display.
"""

import subprocess
import sys
from pathlib import Path

import rpf3d_core as rpf3d

OUT = Path("out/replay")

run = rpf3d.simulate(Path(__file__).parent / "scenes" / "road.yaml", rocks=50)
folder = rpf3d.write_run(run, OUT)
recording = folder / "run.rrd"
print(f"{len(run.flights.deposits.t)} rocks are in {recording} ({recording.stat().st_size / 1e6:.1f} MB)")
print(f"open it with: rpf3d replay {OUT}")

if "--open" in sys.argv:
    subprocess.run([sys.executable, "-m", "rpf3d_core.cli", "replay", folder], check=True)
