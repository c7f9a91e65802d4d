"""Write a price list into a folder as cost.json, cost.png and cost.rrd, and read cost.json again."""

import json
from pathlib import Path

from rpf3d_core.accuracy.choice import errors_of_scene
from rpf3d_core.accuracy.price_list import PriceList, price_list_of, section
from rpf3d_core.accuracy.series import series_of
from rpf3d_core.accuracy.tables import document, findings
from rpf3d_core.errors import InputError
from rpf3d_core.results.folder import check_folder
from rpf3d_core.results.summary import plain, versions

JSON, PICTURE, RECORDING = "cost.json", "cost.png", "cost.rrd"


def write_price_list(folder: str | Path, prices: PriceList, target: float, recording: bool = True) -> Path:
    """Write the price list into a folder and return the folder; results of a run may be in the same folder.

    target : largest total error (-), for the findings and the picture; recording : False to leave out cost.rrd

    Raises
    ------
    InputError
        The folder contains other files, or cannot be written to; or cost.rrd is wanted and rerun is not installed.
    """
    from rpf3d_core.recordings.cost import write_cost_recording
    from rpf3d_core.results.plots.cost import write_cost  # matplotlib takes most of a second to import

    place, series = check_folder(folder), series_of(prices)
    facts = {**section(prices), "versions": versions(), "target": target, "findings": findings(prices, target)}
    try:
        place.mkdir(parents=True, exist_ok=True)
        (place / JSON).write_text(json.dumps(plain(facts), indent=2, allow_nan=False) + "\n", encoding="utf-8")
        write_cost(place / PICTURE, prices.scene, series, target, errors_of_scene(prices).get("parametric"))
        if recording:
            write_cost_recording(place / RECORDING, series, place / PICTURE, document(prices, target))
    except OSError as fault:
        raise InputError(f"{folder}: could not be written ({fault.strerror or fault})") from fault
    return place


def read_price_list(folder: str | Path, digest: str) -> PriceList | None:
    """Return the price list in a folder; None if there is none, or a damaged one, or that of another scene or version.

    With another version of rpf3d, the flights and their cost may differ.

    digest : of the scene
    """
    try:
        facts = json.loads((Path(folder) / JSON).read_text(encoding="utf-8"))
        prices, version = price_list_of(facts), facts["versions"]["rpf3d"]
    except (OSError, KeyError, TypeError, ValueError):
        return None
    return prices if prices.digest == digest and version == versions()["rpf3d"] else None
