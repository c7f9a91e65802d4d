"""Every conversion of a message on damaged ones: it converts or refuses with a sentence, in bounded time and memory.

Damage is drawn from a fixed seed, in the bytes of a sound message as they travel. What rclpy itself cannot read never
reaches a conversion. Each kind is tried in a process of its own with a limit on its memory, so that a crash, a hang or
an allocation without bound is seen.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from quick import long_except

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rosbags", reason="rosbags is not installed")

MUTATIONS = int(os.environ.get("RPF3D_MUTATIONS", "300"))
LONGEST = 240.0 * max(1.0, MUTATIONS / 1000)  # s; the slowest takes 2 s where nothing else runs
MEMORY = 500_000_000
"""Bytes of address space more than the process has once everything is imported: the sound messages take kilobytes."""
FOLDERS = [str(Path(__file__).parents[2] / "support"), str(Path(__file__).parents[3])]

CHILD = """
import random, resource, sys, traceback, warnings
kind, count, memory = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
sys.path[:0] = sys.argv[4:]
warnings.simplefilter("ignore")
from mutated_files import mutated
from mutated_messages import CONVERSIONS
from recorded_messages import without_chance
from rclpy.serialization import deserialize_message
from rpf3d_ros.messages.refusals import MessageRefused

sound, kept, convert = CONVERSIONS[kind]()
whole = without_chance(sound)
convert(whole if kept is bytes else deserialize_message(whole, kept))
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + memory, resource.RLIM_INFINITY))
rng, unread, refused, converted = random.Random(kind), 0, 0, 0
for number in range(count):
    data = mutated(whole, rng)
    message = data
    if kept is not bytes:
        try:
            message = deserialize_message(data, kept)
        except Exception:
            unread += 1
            continue
    try:
        convert(message)
        converted += 1
    except MessageRefused as fault:
        refused += 1
        assert str(fault) and "\\n" not in str(fault), (number, str(fault))
    except BaseException:
        print(f"mutation {number} of {kind}: {bytes(data)[:1500]!r}")
        traceback.print_exc()
        sys.exit(1)
print(unread, refused, converted)
"""

QUICK = {"terrain mesh", "sources", "equipment"}
"""Kinds that `make test` tries: of terrain, of sources, and of what is watched."""

KINDS = [
    "terrain grid", "terrain cloud", "terrain mesh", "positions", "columns", "sources", "clicked point", "source cloud",
    "polygon", "equipment", "results", "markers",
]  # fmt: skip


@pytest.mark.parametrize("kind", long_except(QUICK, KINDS))
def test_a_damaged_message_is_converted_or_refused_and_never_more(kind):
    done = subprocess.run(
        [sys.executable, "-c", CHILD, kind, str(MUTATIONS), str(MEMORY), *FOLDERS],
        capture_output=True, text=True, timeout=LONGEST, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    unread, refused, converted = map(int, done.stdout.split()[-3:])
    assert unread + refused + converted == MUTATIONS
    assert refused > MUTATIONS // 50, "damage must reach the conversion and be noticed there"
