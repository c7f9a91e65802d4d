"""Tests that the folder `hazard` contains all products, with the names of docs/reference/outputs.md."""

from pathlib import Path

import numpy as np
from flights.flights_on_a_floor import SURVEY, floor
from hazards.hazard_layers import lines_of_rocks, maps_of

from rpf3d_core.results.hazard_folder import write_hazard
from rpf3d_core.results.plots.hazard import write_hazard_pictures
from rpf3d_core.results.shown import MapContent, RunCounts
from rpf3d_core.scene.hazard import HazardSpec

OUTPUTS = Path(__file__).parents[2] / "docs" / "reference" / "outputs.md"


def test_everything_is_written_and_named_in_the_documentation(tmp_path):
    terrain = floor(SURVEY)
    maps = maps_of(terrain, lines_of_rocks(terrain), 2.0)
    content = MapContent("floor", terrain, {}, RunCounts(300, 300, {}))
    (tmp_path / "hazard").mkdir()
    write_hazard(tmp_path / "hazard", terrain, maps, HazardSpec(), "EPSG:31287")
    write_hazard_pictures(tmp_path / "hazard", content, maps, np.zeros((1, 3)))
    names = {path.name for path in (tmp_path / "hazard").iterdir()}
    assert {Path(name).suffix for name in names} == {".tif", ".geojson", ".csv", ".png"}
    assert len(names) == 8 + 1 + 1 + 3
    text = OUTPUTS.read_text()
    assert [name for name in sorted(names) if f"`{name}`" not in text] == []
