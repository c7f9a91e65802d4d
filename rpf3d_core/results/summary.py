"""Build the content of summary.json: the scene, the program's versions, wall times and results of a run.

Names of keys include units. Each share has a 95 % sampling interval (Wilson); in a run over parameter sets, also a
predictive interval. A value that does not exist is null.
"""

import importlib.metadata
import platform
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from rpf3d_core.ensemble.bodies import WHY_STOPPED
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import PERCENTILES, share_of
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.benches import ALL_SOURCES, ZONE, bench_table, benches_section, lost_in_words, with_predictive
from rpf3d_core.hazard.by_source.each_source import worst_benches
from rpf3d_core.hazard.convergence import convergence_section
from rpf3d_core.hazard.maps import HazardMaps, reach_probability
from rpf3d_core.hazard.passages import passage_per_metre
from rpf3d_core.results.findings import Run, sentence_of
from rpf3d_core.results.hazard_files.zones_geojson import zones_section
from rpf3d_core.results.observed import compare
from rpf3d_core.results.orientations import blocks_of
from rpf3d_core.results.overconfidence import MISFIT_HELD, MISFIT_LEFT_OUT, MISFIT_LEFT_OUT_AT_BARRIERS
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import releases_digest, scene_digest
from rpf3d_core.scene.zone_materials import without_friction
from rpf3d_core.setup.areas import REACHED_BY
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.values import Outcome

PACKAGES = ("rpf3d", "numpy", "numba", "vtk", "pyarrow", "matplotlib", "shapely", "rerun-sdk")
"""Packages whose versions summary.json records."""


def summary(findings: Run) -> dict[str, Any]:
    """Return the summary of a run as plain values, ready for JSON.

    Raises
    ------
    InputError
        The file of the observed end points is damaged, or the file of a shape has been removed or damaged.
    """
    scene, terrain, totals = findings.scene, findings.terrain, findings.totals
    benches = _benches(terrain, findings.maps)
    facts = {
        "program": "rpf3d",
        "versions": versions(),
        "scene": {
            "file": scene.path.name,
            **_digests(scene),
            **_settings(scene),
            "materials_with_default_friction": list(without_friction(scene, terrain.zones)),
        },
        "terrain": _terrain(scene, terrain, findings.faults),
        **_counts(findings),
        "lost_to_holes": _lost(findings),
        **_unknowns(findings),
        **_speed(findings),
        **_distributions(scene, totals, findings.maps.sets),
        "stopped_in_zones": {zone: bench["stopped"] for zone, bench in benches["zones"].items()},
        "areas_of_interest": benches["areas_of_interest"],
        "benches": benches["zones"],
        **_sources(findings.maps),
        "hazard": {
            **_hazard(findings.maps),
            **_reach(findings.maps),
            "zones": zones_section(findings.maps, scene.hazard),
        },
    }
    if findings.maps.barriers:
        from rpf3d_core.results.hazard_files.barriers_report import MEANING

        facts["barriers"], facts["barriers_count"] = _barriers(findings.maps), MEANING
    if scene.areas_of_interest:
        facts["areas_reached_by"] = REACHED_BY
    if findings.steps:
        facts["convergence"] = convergence_section(
            findings.steps, scene.target.half_width, scene.target.p95_energy
        )  # fmt: skip
    if scene.observed is not None:
        facts["observed"] = compare(scene.observed, terrain.frame, totals.stops)
    return dict(plain(facts))


def _benches(terrain: Terrain, maps: HazardMaps) -> dict[str, Any]:
    """Return the bench table for summary.json; with several sources, also the worst source of each place.

    The key `worst_source` has each figure of the place, taken from the source for which this figure is worst. Its keys
    `source` (of reached and stopped rocks), `retained_source` and `energy_source` name these sources; null stands for
    all rocks together.
    """
    sections = benches_section(bench_table(terrain, maps))
    if maps.sources is None:
        return sections
    for bench in worst_benches(terrain, maps):
        kind = "zones" if bench.kind == ZONE else "areas_of_interest"
        figures = benches_section([bench])[kind][bench.name]
        names = ("source", "retained_source", "energy_source")
        worst = {name: None if getattr(bench, name) == ALL_SOURCES else getattr(bench, name) for name in names}
        sections[kind][bench.name]["worst_source"] = {**worst, **figures}
    return sections


def _sources(maps: HazardMaps) -> dict[str, Any]:
    """Return the numbers of rocks flown from each source, and lost to holes; {} for a scene with one source."""
    if (found := maps.sources) is None:
        return {}
    counts = zip(found.names, found.flown.tolist(), found.lost.tolist(), strict=True)
    return {"sources": [{"name": name, "rocks": rocks, "lost_to_holes": lost} for name, rocks, lost in counts]}


def versions() -> dict[str, str | None]:
    """Return the versions of Python and of the packages that affect a result.

    None for a package that is not installed.
    """
    return {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}}


def plain(value: Any) -> Any:
    """Return a value as a type that JSON supports: Python numbers, lists for arrays, None for NaN and infinity."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(item) for item in value]
    number = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(number, float) and not np.isfinite(number) else number


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _digests(scene: Scene) -> dict[str, str]:
    """Return the digests of the scene, and of its rocks and sources, for summary.json (see `scene.reading`)."""
    return {"digest": scene_digest(scene), "releases_digest": releases_digest(scene)}


def _settings(scene: Scene) -> dict[str, Any]:
    """Return the settings of the scene that affect the result, without the materials, for summary.json."""
    names = ("stop_speed", "gravity", "smallest_bounce", "max_time", "max_impacts")
    return {
        "seed": scene.seed,
        "rebound": scene.impact_model.name,
        "rebound_parameters": scene.impact_model.model_spec.model_dump(mode="json"),
        "ground": scene.ground_model.name,
        "ground_parameters": scene.ground_model.model_spec.model_dump(mode="json"),
        **{name: getattr(scene, name) for name in names},
        "effects": {name: model_spec.model_dump(mode="json") for name, model_spec in scene.effects.named.items()},
        "method": scene.method.describe(),
    }


def _terrain(scene: Scene, terrain: Terrain, faults: FaultReport) -> dict[str, Any]:
    return {
        "triangles": len(terrain.triangles),
        "vertices": len(terrain.vertices),
        "zones": list(terrain.zones),
        "up": terrain.frame.up,
        "local_origin_z_up": terrain.frame.origin,
        "crs": scene.terrain.crs,
        "faults": {
            key: value for key, value in asdict(faults).items() if key != "seen" and (key != "remarks" or value)
        },
    }


def _counts(findings: Run) -> dict[str, Any]:
    totals = findings.totals
    return {
        "engine": findings.flights.engine,
        "rocks": totals.rocks,
        "partial": totals.rocks < findings.planned,
        "rocks_planned": findings.planned,
        "outcomes": {
            outcome.name.lower(): {
                **_share_of(outcome, count, findings),
                "sentence": sentence_of(outcome, findings.scene),
            }
            for outcome in Outcome
            if (count := totals.outcomes[outcome])
        },
        **_shapes(findings),
        "impacts": totals.impacts,
        "path_m": totals.path_m,
        **_pieces(findings),
    }


def _share_of(outcome: Outcome, count: int, findings: Run) -> dict[str, Any]:
    """Return the share of rocks with an outcome for summary.json; over parameter sets, with a predictive interval.

    count : number of rocks with the outcome
    """
    share = share_of(count, findings.totals.rocks)
    figures = findings.maps.sets
    return share if figures is None else {**with_predictive(share, *figures.outcome(outcome)),
                                           **_left_out(figures, "outcome")}  # fmt: skip


def _left_out(figures: Any, name: str) -> dict[str, str]:
    """Return the entry `leaves_out` of a figure whose predictive interval does not include a stated misfit; else {}.

    figures : `hazard.by_set.sets.SetFigures`; name : of the figure
    """
    return {} if figures.displaced is None or figures.is_displaced(name) else {"leaves_out": MISFIT_LEFT_OUT}


def _barriers(maps: HazardMaps) -> dict[str, Any]:
    """Return the section `barriers` of summary.json; with a misfit, it states that intervals omit the misfit.

    With several sources, the key `worst_source` has each figure, taken from the source for which this figure is worst,
    with the name of the source.
    """
    from rpf3d_core.results.hazard_files.barriers_report import barriers_section, worst_section

    has_misfit = maps.sets is not None and maps.sets.displaced is not None
    left_out = {"leaves_out": MISFIT_LEFT_OUT_AT_BARRIERS} if has_misfit else {}
    worst = {name: {"worst_source": found} for name, found in worst_section(maps).items()}
    return {name: {**found, **left_out, **worst.get(name, {})} for name, found in barriers_section(maps).items()}


def _unknowns(findings: Run) -> dict[str, Any]:
    """Return the parameter sets of a run over unknowns, and the meaning of its intervals; empty without unknowns."""
    figures, spec = findings.maps.sets, findings.scene.unknowns
    if figures is None or spec is None:
        return {}
    values = figures.sets.values
    parameters = {
        name: {"low": values[:, i].min(), "high": values[:, i].max(), "mean": values[:, i].mean()}
        for i, name in enumerate(figures.sets.names)
    }
    return {
        "unknowns": {
            "sets": len(figures.sets),
            "sets_flown": figures.flown,
            "sample": None if spec.sample is None else spec.sample.name,
            **({} if figures.displaced is None else {"misfit_m": spec.misfit, "misfit": MISFIT_HELD}),
            "parameters": parameters,
            "sampling": "95 % interval of the number of rocks, for these parameter sets",
            "predictive": "95 % interval of the result at the site, whose parameters are drawn as the sets are",
        }
    }


def _with_intervals(name: str, sample: Sample, figures: Any) -> dict[str, Any]:
    """Return a distribution for summary.json, with intervals of its percentiles in a run over parameter sets.

    name : of the quantity in `figures`; sample : values of all rocks
    figures : `hazard.by_set.sets.SetFigures`, None without parameter sets
    """
    facts = sample.summary(PERCENTILES)
    if figures is None:
        return facts
    sampling = {f"p{p}": list(sample.interval(p)) for p in PERCENTILES}
    return {**facts, "sampling": sampling, "predictive": figures.percentile(name), **_left_out(figures, name)}


def _lost(findings: Run) -> dict[str, Any]:
    """Return the share of rocks lost to holes of the terrain, with a sentence on its effect on the other shares.

    The key `meaning` has the sentence; it is None if no rock was lost.
    """
    lost, rocks = findings.totals.outcomes[Outcome.LOST_TO_HOLE], findings.totals.rocks
    return {**share_of(lost, rocks), "meaning": lost_in_words(lost, rocks) if lost else None}


def _pieces(findings: Run) -> dict[str, Any]:
    """Return the number of fragments, and the mass of fragments too small to fly; empty if rocks cannot break."""
    if findings.scene.effects.fragmentation is None:
        return {}
    return {"pieces": findings.totals.pieces, "mass_lost_kg": findings.totals.mass_lost_kg}


def _shapes(findings: Run) -> dict[str, Any]:
    """Return the entries of the summary on rocks with a shape: stop reasons, lifted rocks, names; {} without shapes.

    A rock is lifted at its release if its shape would overlap the ground there.
    """
    blocks = blocks_of(findings.scene, findings.flights.deposits)
    if not blocks:
        return {}
    why = {reason: findings.totals.why[reason] for reason in WHY_STOPPED}
    if not any(spec.OBSTACLES for spec in findings.scene.effects.named.values()):  # no obstacle to lean against
        del why["leaning"]
    totals = findings.totals
    return {
        "stopped_because": why,
        "lifted_at_release": {**share_of(totals.lifted, totals.rocks), "largest_m": totals.most_lifted},
        "shapes": {str(number): block.name for number, block in enumerate(blocks)},
    }


def _speed(findings: Run) -> dict[str, Any]:
    """Return the wall times of the run (s) for summary.json, and `rocks_per_s`: rocks per second of flying, `fly_s`.

    `rocks_per_s` is None if `fly_s` is 0.
    """
    flights = findings.flights
    rate = findings.totals.rocks / flights.fly_s if flights.fly_s > 0.0 else None
    return {**findings.timings, "compile_s": flights.compile_s, "fly_s": flights.fly_s, "rocks_per_s": rate}


def _distributions(scene: Scene, totals: Totals, figures: Any) -> dict[str, Any]:
    return {
        "runout_m": {"of": "rocks at rest, horizontal", **_with_intervals("runout", totals.runout, figures)},
        "max_speed_m_s": {
            "of": "all rocks but failed ones",
            **_with_intervals("max_speed", totals.max_speed, figures),
        },
        "max_energy_j": {
            "of": "all rocks but failed ones, translational",
            **_with_intervals("max_energy", totals.max_energy, figures),
        },
        **_energies_of_spin(totals),
        "max_height_m": {
            "of": f"all rocks but failed ones, vertical above the terrain{_of_the_centre(scene)}",
            **_with_intervals("max_height", totals.max_height, figures),
        },
        "entered_ground_at_speed_m_s": {
            "of": f"rocks whose bounces died out; ground model {scene.ground_model.name}",
            **_with_intervals("ground_speed", totals.ground_speed, figures),
        },
    }


def _of_the_centre(scene: Scene) -> str:
    """Return ", of the centre of mass", which ends a text on heights of bodies; "" for points and spheres."""
    return ", of the centre of mass" if scene.rock.is_body else ""


def _energies_of_spin(totals: Totals) -> dict[str, Any]:
    """Return the distributions of rotational and total energy for summary.json; empty if rocks do not spin."""
    if not totals.spins:
        return {}
    of = "all rocks but failed ones, each one's largest,"
    return {
        "max_rotational_energy_j": {"of": f"{of} rotational", **totals.max_rotational_energy.summary(PERCENTILES)},
        "max_total_energy_j": {
            "of": f"{of} translational and rotational together",
            **totals.max_total_energy.summary(PERCENTILES),
        },
    }


def _hazard(maps: HazardMaps) -> dict[str, Any]:
    """Return the size of the hazard maps, the numbers of reached cells and facets, and the error of percentiles (-).

    The error is an upper bound of the relative error of every percentile of the maps.
    """
    return {
        "cell_m": maps.raster.cell,
        "energy": maps.energy_kind,
        "columns": maps.raster.nx,
        "rows": maps.raster.ny,
        "cells_reached": len(maps.cells.cell),
        "facets_reached": len(maps.facets.cell),
        "percentiles_within": max(maps.cells.percentiles_within, maps.facets.percentiles_within),
    }


def _reach(maps: HazardMaps) -> dict[str, Any]:
    """Return the largest reach probability of a cell, and the largest number of passages per metre if mapped.

    Reach probability grows with the cell size; passages per metre do not.
    """
    share, cell = reach_probability(maps.cells, maps.flown), maps.raster.cell
    reach = {"of": f"cells of {cell:g} m; grows with the cell", "max": share.max(initial=0.0), "cell_m": cell}
    if maps.worst_cells is not None:
        reach["max_of_a_source"] = maps.worst_cells.reach.max(initial=0.0)
    if not maps.cells.has_ways:
        return {"reach_probability": reach}
    passage = passage_per_metre(maps)
    most = int(passage.value.argmax()) if len(passage.value) else None
    ends = None if most is None else [passage.low[most], passage.high[most]]
    per_metre = {
        "of": f"passages per metre across the rocks' way, mean over cells of {cell:g} m",
        "max": passage.value.max(initial=0.0),
        "interval_95_of_max": ends,
        "cell_m": cell,
    }
    return {"reach_probability": reach, "passage_per_metre": per_metre}
