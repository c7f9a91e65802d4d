"""Measure rocks with a shape at Authume and Chant Sura, for the validation page: some minutes of CPU time.

The set of the shipped scene is the best of a search in x alone; it goes to the impacts of Chant Sura as it is.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from field_cases import chant_sura
from field_cases.blocks import impacts, quarry
from field_cases.measuring import calibration
from field_cases.search import Found

NEAR_BEST = 5
"""Number of the search's best sets on the page, which show what x leaves open."""
Say = Callable[[str], None]


def measured(say: Say) -> dict[str, Any]:
    """Measure all figures of the section on rocks with a shape, in the form of the file of results."""
    at_quarry = _at_quarry(say)
    return {"quarry": at_quarry, "impacts": _impacts(at_quarry["parameters"], say)}


def _at_quarry(say: Say) -> dict[str, Any]:
    """Return the figures at Authume of the best set in x, and of the sets near it."""
    sets = quarry.best_in_x()
    best = sets[0].parameters
    say(f"Authume, blocks: {best}, {sets[0].error:.2f} m of {sets[0].tried} sets")
    figures, flown = quarry.simulated(best)
    found = {
        **calibration(quarry.FREE, sets[0]),
        "near": [_near(one) for one in sets[:NEAR_BEST]],
        "all": figures,
        "chance": quarry.chance(flown),
        "by_shape": quarry.by_shape(flown),
        "variants": quarry.variants(best),
    }
    say("Authume, blocks: variants")
    return found


def _near(found: Found) -> dict[str, Any]:
    """Return a set of the search's last round, and the figures of its rocks in the search."""
    figures = quarry.compared(quarry.searched(found.parameters))
    names = ("mean", "sd", "side_sd", "beyond", "bars")
    return {"parameters": found.parameters, "error": found.error, **{name: figures[name] for name in names}}


def _impacts(of_quarry: Mapping[str, float], say: Say) -> dict[str, Any]:
    """Return the figures at Chant Sura: Authume's set as it is, and a calibration with each run kept out."""
    contacts, six = chant_sura.contacts(), chant_sura.published()
    found = impacts.calibrate(contacts)
    say(f"Chant Sura, blocks: {found.parameters}, {found.error:.2f} m/s")
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
