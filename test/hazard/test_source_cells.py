"""Tests of the maps of the worst source of each cell: harmless sources do not hide a dangerous one in any cell."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rasterio
from scenes.sources_of_pit import UNKNOWN, scene_of

import rpf3d_core as rpf3d
from rpf3d_core.desk.shapes import ground_seen, hazard_map
from rpf3d_core.hazard.by_source import source_cells
from rpf3d_core.hazard.by_source.source_cells import SourceCells, WorstCells
from rpf3d_core.hazard.by_source.source_tallies import part_of
from rpf3d_core.hazard.by_source.worst import ALL
from rpf3d_core.hazard.layers import layers_of
from rpf3d_core.hazard.maps import HazardMaps, Layers, reach_probability
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.zones import CLASS, REACH, WORST_CLASS, WORST_REACH, Zone, matrix_zones, worst_matrix_zones
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.geotiffs import write_hazard_rasters
from rpf3d_core.results.hazard_files.zones_geojson import hazard_zones, zones_without_cells
from rpf3d_core.results.plots.hazard_themes import themes
from rpf3d_core.runs.parallel import fly_parts
from rpf3d_core.scene.hazard import HazardSpec, matrix_of
from rpf3d_core.setup.prepared import empty_tallies, prepare

ROCKS = {"top": 200, "below": 2000}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cells")


@pytest.fixture(scope="module")
def run(folder: Path) -> Run:
    return rpf3d.simulate(scene_of(folder, rocks=ROCKS))


def flown(
    folder: Path, *names: str, rocks: dict[str, int], more: str = "", engine: str = "compiled"
) -> tuple[Run, Tallies]:
    """Return a run with its counts."""
    kept: list[Tallies] = []
    with pytest.MonkeyPatch.context() as patch:
        maps = Tallies.maps

        def keep(tallies: Tallies, *given: object) -> HazardMaps:
            kept.append(tallies)
            return maps(tallies, *given)  # type: ignore[arg-type]

        patch.setattr(Tallies, "maps", keep)
        return rpf3d.simulate(scene_of(folder, *names, rocks=rocks, more=more), engine=engine), kept[-1]


def same(ours: Layers, theirs: Layers) -> bool:
    arrays = ("cell", "rocks", "impacts", "passages", "deposits", "first_arrival")
    return all(np.array_equal(getattr(ours, name), getattr(theirs, name)) for name in arrays) and all(
        np.array_equal(vars(getattr(ours, name))[each], vars(getattr(theirs, name))[each], equal_nan=True)
        for name in ("energy", "speed", "height") for each in ("largest", "mean", "p95")
    )  # fmt: skip


@pytest.mark.parametrize("engine", ["compiled", "reference"])
@pytest.mark.parametrize("more", ["", UNKNOWN], ids=["known", "unknowns"])
def test_a_source_has_in_each_cell_what_it_has_alone(more: str, engine: str, folder: Path) -> None:
    """The first source of a scene has the same random numbers with and without further sources."""
    few = {"top": 60, "below": 40}
    _, both = flown(folder, "top", "below", rocks=few, more=more, engine=engine)
    alone, _ = flown(folder, "top", rocks=few, more=more, engine=engine)
    assert same(part_of(layers_of(both.sources.cells.tally), 0, 2), alone.maps.cells)


def test_values_are_the_largest_of_all_sources(folder: Path) -> None:
    run, tallies = flown(folder, rocks=ROCKS)
    worst, cells, layers = run.maps.sources.cells, run.maps.cells, layers_of(tallies.sources.cells.tally)
    reach, energy = np.zeros((2, len(cells.cell))), np.full((3, len(cells.cell)), np.nan)
    for number, rocks in enumerate((200, 2000)):
        own = part_of(layers, number, 2)
        reach[number] = own.everywhere(own.rocks / rocks, 0.0)[cells.cell]
        energy[number] = own.everywhere(own.energy.p95.astype(float), np.nan)[cells.cell]
    energy[2] = cells.energy.p95
    assert np.array_equal(worst.reach, reach.max(axis=0))
    assert np.array_equal(worst.reach_source, reach.argmax(axis=0))
    assert np.array_equal(worst.energy, np.fmax.reduce(energy), equal_nan=True)
    known = np.isfinite(worst.energy)
    which = np.nan_to_num(energy[:, known], nan=-1.0)
    expected = np.where(which[:2].max(axis=0) > which[2], which[:2].argmax(axis=0), ALL)
    assert np.array_equal(worst.energy_source[known], expected)
    assert (worst.energy_source[~known] == ALL).all() and {0, 1} <= set(worst.reach_source.tolist())
    assert (worst.reach >= reach_probability(cells, run.maps.flown)).all()
    assert worst.reach.max() > 5 * reach_probability(cells, run.maps.flown)[worst.reach.argmax()]


def values_of(worst: WorstCells | None) -> list[list[float]]:
    assert worst is not None
    return [np.nan_to_num(values, nan=-2.0).tolist() for values in worst]


def test_a_run_in_parts_has_the_same_values(run: Run, folder: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        parts = fly_parts(scene_of(folder, rocks=ROCKS), 3, pool)
    assert values_of(parts.maps.sources.cells) == values_of(run.maps.sources.cells)


def test_memory_is_bounded(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The counts are given up if all cells of all sources, or the reached cells, would need too much memory."""
    tallies = empty_tallies(prepare(scene_of(folder, rocks=ROCKS)))
    squares = tallies.squares
    assert SourceCells(squares, 2).tally is not None
    assert SourceCells(squares, int(0.5 * squares.limit / 4 / len(squares.slot)) + 1).tally is None
    assert SourceCells(None, 0).tally is None
    reached = len(run.maps.cells.cell)

    def with_room_for(cells: float) -> WorstCells | None:
        made = SourceCells.__init__

        def limited(self: SourceCells, squares: object, sources: int) -> None:
            made(self, squares, sources)  # type: ignore[arg-type]
            self.most = cells

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(SourceCells, "__init__", limited)
            whole = rpf3d.simulate(scene_of(folder, rocks=ROCKS)).maps.sources.cells
            with ThreadPoolExecutor(2) as pool:
                parts = fly_parts(scene_of(folder, rocks=ROCKS), 3, pool).maps.sources.cells
        assert (whole is None) == (parts is None)
        return whole

    assert with_room_for(2.0 * reached) is not None
    assert with_room_for(0.5 * reached) is None


@pytest.mark.parametrize("read", [1, 2], ids=["while its counts are added", "before the limit is checked"])
def test_a_thread_may_give_the_counts_up_while_another_counts(folder: Path, read: int) -> None:
    """At each place at which a thread reads the counts, another thread may already have given them up."""
    squares = empty_tallies(prepare(scene_of(folder, rocks=ROCKS))).squares

    class GivenUp(SourceCells):
        """Counts of cells that another thread gives up after some reads of `tally`."""

        reads = 0

        @property
        def tally(self) -> object:
            self.reads += 1
            return self.counts if self.reads <= read else None

        @tally.setter
        def tally(self, value: object) -> None:
            self.counts = value

    cells, nothing = GivenUp(squares, 2), SourceCells(squares, 2).tally
    cells.add(nothing)
    cells.reads = 0
    cells.add(nothing)
    assert cells.tally is None


def test_files_have_the_values_and_their_sources(run: Run, tmp_path: Path) -> None:
    write_hazard_rasters(tmp_path, run.terrain, run.maps)
    worst = run.maps.sources.cells
    for name, largest, number in (("reach_probability", worst.reach, worst.reach_source),
                                  ("energy_j", worst.energy, worst.energy_source)):  # fmt: skip
        with rasterio.open(tmp_path / f"{name}_worst_source.tif") as file:
            value, source = (band[::-1].ravel()[run.maps.cells.cell] for band in file.read())
            assert file.descriptions == ("value", "source")
            assert file.tags()["SOURCES"] == "1 top; 2 below"
        assert np.array_equal(value, largest.astype(np.float32), equal_nan=True)
        assert np.array_equal(source[np.isfinite(value)], number[np.isfinite(value)] + 1)


def test_a_scene_without_these_counts_has_no_such_files(run: Run, tmp_path: Path) -> None:
    write_hazard_rasters(tmp_path, run.terrain, replace(run.maps, sources=run.maps.sources._replace(cells=None)))
    assert not list(tmp_path.glob("*_worst_source.tif"))
    assert list(tmp_path.glob("energy_j.tif"))


def test_percentiles_in_many_cells_are_computed_a_part_at_a_time(folder: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(source_cells, "AT_ONCE", 7)
        few = rpf3d.simulate(scene_of(folder, rocks=ROCKS)).maps.sources.cells
    assert values_of(few) == values_of(rpf3d.simulate(scene_of(folder, rocks=ROCKS)).maps.sources.cells)


LEVELS = HazardSpec.model_validate({
    "reach_levels": [0.03, 0.99],
    "matrix": {"energy_levels_kj": [100], "probability_levels": [0.03], "classes": [["low", "low"], ["low", "high"]]},
})  # fmt: skip


def cells_of(zones: Sequence[Zone], kind: str, which: float | str) -> np.ndarray:
    (zone,) = [zone for zone in zones if zone.kind == kind and which in (zone.level, zone.name)]
    return zone.cells


def test_zones_of_the_worst_source_are_the_zones_of_the_dangerous_source_alone(folder: Path, run: Run) -> None:
    """Almost all rocks are from the source `below`, and do not reach the cells of the source `top`."""
    alone = hazard_zones(flown(folder, "top", rocks=ROCKS)[0].maps, LEVELS)
    assert not any(zone.kind in (WORST_REACH, WORST_CLASS) for zone in alone)
    both = hazard_zones(run.maps, LEVELS)
    for worst, kind, which in ((WORST_REACH, REACH, 0.03), (WORST_CLASS, CLASS, "high")):
        dangerous, found = cells_of(alone, kind, which), cells_of(both, worst, which)
        assert dangerous.sum() > (dangerous & cells_of(both, kind, which)).sum(), "the pool hides some of the cells"
        assert found[dangerous].all()


def test_where_the_pool_has_no_zone_the_user_is_told_that_a_source_has_one(run: Run) -> None:
    notes = zones_without_cells(run.terrain, run.maps, LEVELS)
    assert any(f"but such a zone of the worst source (kind {WORST_REACH})" in note for note in notes), notes


def test_classes_for_a_higher_percentile_count_the_largest_energy(run: Run) -> None:
    matrix = matrix_of(LEVELS)._replace(percentile=99)
    assert all(zone.guessed == zone.cells.sum() for zone in worst_matrix_zones(run.maps, matrix))
    assert worst_matrix_zones(run.maps, matrix._replace(object_width=5.0)) == []


def test_pictures_and_the_desk_show_the_worst_source(folder: Path, run: Run) -> None:
    worst, shown = run.maps.sources.cells, themes(run.maps)
    reach = run.maps.cells.everywhere(worst.reach, np.nan)
    assert np.array_equal(shown["reach_probability_worst_source"].values, reach, equal_nan=True)
    energy = run.maps.cells.everywhere(worst.energy, np.nan)
    assert np.array_equal(shown["energy_p95_worst_source"].values, energy, equal_nan=True)
    desk = [hazard_map(ground_seen(run.terrain), run.maps, kind) for kind in ("reach", "energy")]
    assert [each.title.partition(",")[2].split(",")[0] for each in desk] == [" worst source"] * 2
    assert desk[0].largest == pytest.approx(100 * np.nanmax(reach))
    assert desk[1].largest == pytest.approx(np.nanmax(energy) / 1000)
    assert not [name for name in themes(flown(folder, "top", rocks=ROCKS)[0].maps) if "worst" in name]


@pytest.mark.parametrize("limit_kj", [150, 200, 300])
def test_a_class_is_not_too_low_where_a_source_has_too_few_rocks_for_a_percentile(folder: Path, limit_kj: int) -> None:
    """Alone, 19 rocks have their largest energy. Weak rocks of another source in the cell give it a percentile."""
    rocks = {"top": 19, "below": 2000}
    matrix = matrix_of(LEVELS)._replace(energy_levels=(1000.0 * limit_kj,))
    alone = cells_of(matrix_zones(flown(folder, "top", rocks=rocks)[0].maps, matrix), CLASS, "high")
    both = cells_of(worst_matrix_zones(flown(folder, rocks=rocks)[0].maps, matrix), WORST_CLASS, "high")
    assert alone.any() and both[alone].all()
