"""`rpf3d schema`: print the JSON Schema of scene files, with which editors complete keys and mark errors."""

import json
from typing import Annotated

import typer


def schema(
    site: Annotated[bool, typer.Option("--site", help="The schema of site files, for the levels of alerts.")] = False,
) -> None:
    """Print the JSON Schema (2020-12) of scene files on standard output, for editors and other programs."""
    from rpf3d_core.alerts.site_model import Thresholds
    from rpf3d_core.scene.listings.json_schema import model_schema, scene_schema

    found = model_schema(Thresholds, "rpf3d site file") if site else scene_schema()
    print(json.dumps(found, indent=2, allow_nan=False))
