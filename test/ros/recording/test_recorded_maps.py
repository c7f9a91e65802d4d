"""Tests of the recorded map of reach probability: one byte per cell, a colour and a label for each percentage."""

import numpy as np
import pytest

pytest.importorskip("rerun", reason="rerun-sdk is not installed")

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.recordings.content import bytes_by_entity, rows_by_entity, verify
from rpf3d_core.recordings.log import import_rerun
from rpf3d_ros.recording.stream import UNKNOWN, file_recording

MAP = "/plan/reach_probability"
PERCENT = np.arange(-1, 101, dtype=np.int8)
"""All values (%) that a cell may have; -1 is unknown."""


def recorded(tmp_path, *maps):
    recording = file_recording(tmp_path / "maps.rrd")
    for number, percent in enumerate(maps):
        recording.at(1_000_000_000 * (number + 1), number + 1)
        recording.grid(percent)
    recording.close()
    verify(tmp_path / "maps.rrd")
    return tmp_path / "maps.rrd"


def column(file, entity, component):
    """Return the values of an entity's component in a recording file, in the order of the rows."""
    chunks = import_rerun().chunk.RrdReader(str(file)).stream().to_chunks()
    batches = [chunk.to_record_batch() for chunk in chunks if str(chunk.entity_path) == entity]
    found = [(batch, name) for batch in batches for name in batch.schema.names if name.endswith(component)]
    assert found, [batch.schema.names for batch in batches]
    return [value for batch, name in found for value in batch.column(name).to_pylist()]


def test_a_map_takes_a_byte_a_cell(tmp_path):
    maps = [np.full((300, 400), percent, dtype=np.int8) for percent in (-1, 0, 100)]
    file = recorded(tmp_path, *maps)
    assert rows_by_entity(file)[MAP] == 3
    cells = 3 * 300 * 400
    assert cells <= bytes_by_entity(file)[MAP] < 1.1 * cells


def test_every_percentage_has_its_colour_and_label_and_unknown_cells_none(tmp_path):
    file = recorded(tmp_path, PERCENT.reshape(6, 17))
    ((found,),) = column(file, "/plan", "AnnotationContext:context")
    classes = {each["class_id"]: each["class_description"]["info"] for each in found}
    assert set(classes) == {*range(101), UNKNOWN}
    red, green, blue = speed_colours(np.array([37.0]), 100.0)[0].tolist()
    assert classes[37]["color"] == (red << 24) + (green << 16) + (blue << 8) + 255
    assert (classes[37]["label"], classes[UNKNOWN]["label"]) == ("37 %", "unknown")
    assert classes[UNKNOWN]["color"] & 255 == 0, "transparent"


def test_the_northernmost_row_is_on_top(tmp_path):
    file = recorded(tmp_path, PERCENT.reshape(6, 17))
    ((buffer,),) = column(file, MAP, "SegmentationImage:buffer")
    pixels = np.array(buffer, dtype=np.uint8).reshape(6, 17)
    assert pixels[0].tolist() == list(range(84, 101))
    assert pixels[-1].tolist() == [UNKNOWN, *range(16)]
