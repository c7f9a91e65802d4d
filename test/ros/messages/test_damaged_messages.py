"""Tests that each conversion of a damaged message succeeds or refuses with a reason, in bounded time and memory.

Damage is drawn from a fixed seed and applied to the serialised bytes of a valid message. Messages that rclpy cannot
read do not reach a conversion. Each kind is tried in a separate process with limited memory, so that a crash, a hang
or an unbounded allocation is detected.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from suite.quick import long_except

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
pytest.importorskip("rosbags", reason="rosbags is not installed")

MUTATIONS = int(os.environ.get("RPF3D_MUTATIONS", "300"))
LONGEST = 240.0 * max(1.0, MUTATIONS / 1000)  # time limit (s); the slowest kind takes 2 s on an idle machine
MEMORY = 500_000_000
"""Address space (bytes) that the process may take after all imports; valid messages take kilobytes."""
FOLDERS = [str(Path(__file__).parents[2] / "support"), str(Path(__file__).parents[3])]

CHILD = """
import random, resource, sys, traceback, warnings
kind, count, memory = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
sys.path[:0] = sys.argv[4:]
warnings.simplefilter("ignore")
from input_files.mutated_files import mutated
from messages.mutated_messages import CONVERSIONS
from messages.recorded_messages import without_chance
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
"""Kinds that `make test` tries: one of terrain, one of sources, one of areas."""

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
