"""Measure, write and read price lists for `rpf3d cost` and `rpf3d run --accuracy`, without printing."""

from pathlib import Path

from rpf3d_core.accuracy.choice import check_target
from rpf3d_core.accuracy.files import read_price_list, write_price_list
from rpf3d_core.accuracy.measure import Tell, price_list
from rpf3d_core.accuracy.price_list import PriceList
from rpf3d_core.results.folder import check_folder
from rpf3d_core.scene.reading import read_scene, scene_digest


def measured(scene: Path, out: Path, target: float, tell: Tell) -> PriceList:
    """Measure the price list of a scene, write it into a folder and return it.

    scene : scene file; out : folder to write to; target : largest total error (-), for the findings
    tell : called with each progress text

    Raises
    ------
    InputError
        The target is not between 0 and 1, the folder or the scene is invalid, numba or rerun is not installed, or the
        files cannot be written. Target and folder are checked before the measurement.
    """
    check_target(target)
    check_folder(out)
    prices = price_list(scene, tell)
    write_price_list(out, prices, target)
    return prices


def kept_or_measured(scene: Path, out: Path, target: float, tell: Tell) -> PriceList:
    """Return the price list of a scene: read it from the folder `out`, or measure it and write it into this folder.

    The price list is measured if the folder has no price list, or the price list of another scene or of another version
    of rpf3d. `measured` describes the parameters and the errors.
    """
    check_target(target)
    kept = read_price_list(out, scene_digest(read_scene(scene)))
    return measured(scene, out, target, tell) if kept is None else kept
