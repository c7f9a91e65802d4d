"""Measure rocks with a shape at the three sites, for the validation page: about ten minutes of CPU time.

The set that is calibrated at Authume on x alone goes to the other two sites as it is.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from field_cases import authume, chant_sura, tschamut
from field_cases.blocks import impacts, meadow, quarry
from field_cases.search import Found, Free
from rpf3d_core.ensemble.flights import FloatArray

NEAR_BEST = 5
"""Number of the search's best sets on the page, which show what x leaves open."""
Say = Callable[[str], None]


class BlocksMeasured(NamedTuple):
    """The result: figures by site, in the form of the file of results, and the end points (N, 3) m at Authume."""

    results: dict[str, Any]
    ends: FloatArray


def measured(say: Say) -> BlocksMeasured:
    """Calibrate rocks with a shape at each site, and measure all figures of the page."""
    at_quarry, ends = _at_quarry(say)
    of_quarry = at_quarry["parameters"]
    results = {"authume": at_quarry, "tschamut": _at_meadow(of_quarry, say), "chant_sura": _impacts(of_quarry, say)}
    at_quarry["from_tschamut"], _ = quarry.simulated(results["tschamut"]["parameters"], quarry.OTHER_ROCKS)
    return BlocksMeasured(results, ends)


def _at_quarry(say: Say) -> tuple[dict[str, Any], FloatArray]:
    """Return the figures at Authume, and the end points (N, 3) m of the calibrated rocks."""
    first, second = authume.halves()
    sets = quarry.calibrate([*first, *second])
    best = sets[0].parameters
    say(f"authume, blocks: {best}, {sets[0].error:.2f} m of {sets[0].tried} sets")
    figures, flown = quarry.simulated(best)
    halves = [_half(quarry.calibrate(half)[0]) for half in (first, second)]
    say("authume, blocks: halves")
    found = {
        **calibration(quarry.FREE, sets[0]),
        "near": [_near(one) for one in sets[:NEAR_BEST]],
        "all": figures,
        "chance": quarry.chance(flown),
        "halves": halves,
        "by_shape": quarry.by_shape(flown),
        "variants": quarry.variants(best),
    }
    say("authume, blocks: variants")
    return found, flown.ends.end


def _half(found: Found) -> dict[str, Any]:
    """Return a calibration on half of the blocks, and the figures of rocks that fly with it."""
    figures, _ = quarry.simulated(found.parameters, quarry.OTHER_ROCKS)
    return {**calibration(quarry.FREE, found), "all": figures}


def _near(found: Found) -> dict[str, Any]:
    """Return a set of the search's last round, and the figures of its rocks in the search."""
    figures = quarry.compared(quarry.searched(found.parameters))
    names = ("mean", "sd", "side_sd", "beyond", "bars")
    return {"parameters": found.parameters, "error": found.error, **{name: figures[name] for name in names}}


def _at_meadow(of_quarry: Mapping[str, float], say: Say) -> dict[str, Any]:
    """Return the figures at Tschamut: Authume's set as it is, and sets of all runs and of each half."""
    first, second = tschamut.halves()
    carried, rocks = meadow.simulated(of_quarry)
    sets = meadow.calibrate(sorted([*first, *second]))
    fitted, of_fitted = meadow.simulated(sets[0].parameters)
    say(f"tschamut, blocks: {sets[0].parameters}, {sets[0].error:.2f} m")
    halves = []
    for half in (first, second):
        found = meadow.calibrate(half)[0]
        halves.append({**calibration(meadow.FREE, found), "all": meadow.simulated(found.parameters)[0]})
    say("tschamut, blocks: halves")
    return {
        **calibration(meadow.FREE, sets[0]),
        "from_authume": carried,
        "all": fitted,
        "halves": halves,
        "by_block": {"from_authume": meadow.by_block(rocks), "all": meadow.by_block(of_fitted)},
    }


def _impacts(of_quarry: Mapping[str, float], say: Say) -> dict[str, Any]:
    """Return the figures at Chant Sura: Authume's set as it is, and a calibration with each run kept out."""
    contacts, six = chant_sura.contacts(), chant_sura.published()
    found = impacts.calibrate(contacts)
    say(f"chant_sura, blocks: {found.parameters}, {found.error:.2f} m/s")
    slopes = {f"{slope:g}": {**of_quarry, "slope_deg": slope} for slope in chant_sura.SLOPES}
    return {
        **calibration(impacts.FREE, found),
        "from_authume": {
            **_of_six(of_quarry, six),
            "contacts": {slope: impacts.of_impacts(law, contacts) for slope, law in slopes.items()},
        },
        "all": {**_of_six(found.parameters, six), "contacts": impacts.of_impacts(found.parameters, contacts)},
        "kept_out": impacts.kept_out(),
    }


def _of_six(law: Mapping[str, float], six: Sequence[chant_sura.Impact]) -> dict[str, Any]:
    """Return the figures of the six impacts, without spin and with the spin of such blocks."""
    return {
        "published": impacts.of_impacts(law, six),
        "spinning": impacts.of_impacts(law, six, chant_sura.SPIN),
    }


def calibration(free: Sequence[Free], found: Found) -> dict[str, Any]:
    """Return the result of a search, and the parameters at the edge of the searched range."""
    at_edge = [one.name for one in free if found.parameters[one.name] in (one.low, one.high)]
    return {"parameters": found.parameters, "error": found.error, "tried": found.tried, "at_edge": at_edge}
