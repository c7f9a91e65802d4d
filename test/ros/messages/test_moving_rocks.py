"""Tests of the positions of published rocks at evenly spaced times."""

import numpy as np
import pytest

from rpf3d_ros.messages.moving_rocks import FRAME, MOST_FRAMES, MOST_ROCKS, motion_of


def along(*tracks):
    """Return points (N, 3), times (N,) and rock numbers (N,) of tracks [(t, x), ...] along the x axis, one per rock."""
    rows = [(t, x, rock) for rock, track in enumerate(tracks) for t, x in track]
    t, x, rock = (np.array(column) for column in zip(*rows, strict=True))
    return np.stack([x, 0 * x, 0 * x], axis=-1).astype(float), t.astype(float), rock.astype(np.uint32)


def test_a_rock_moves_straight_between_its_points_and_lies_where_it_ended():
    motion = motion_of(*along([(0.0, 0.0), (1.0, 10.0)], [(0.0, 5.0), (0.2, 5.0)]))
    assert motion.times == pytest.approx(FRAME * np.arange(11))
    assert motion.positions[:, 0, 0] == pytest.approx(motion.times * 10.0)
    assert motion.positions[:, 1, 0] == pytest.approx(5.0)


def test_many_rocks_and_long_falls_are_bounded():
    tracks = [[(0.0, float(rock)), (1.0e4, float(rock))] for rock in range(3 * MOST_ROCKS)]
    motion = motion_of(*along(*tracks))
    assert motion.positions.shape == (MOST_FRAMES, MOST_ROCKS, 3)
    assert motion.positions[0, [0, -1], 0] == pytest.approx([0.0, 3.0 * MOST_ROCKS - 1.0])


def test_no_points_are_no_frames():
    motion = motion_of(np.empty((0, 3)), np.empty(0), np.empty(0, dtype=np.uint32))
    assert motion.positions.shape == (0, 0, 3)
