"""Write the lists of parameters in docs/reference/parameters.md from their declarations in the code.

python docs/parameter_tables.py
"""

from dataclasses import fields
from pathlib import Path
from typing import Any

from list_items import item

from rpf3d_core.live.scene import live_parameters, why_excluded
from rpf3d_core.scene.listings.fields import SceneField
from rpf3d_ros.interface.parameters import (
    AlarmBridgeParameters,
    FrameParameters,
    RecorderParameters,
    ScenePublisherParameters,
    SimulatorParameters,
)

PAGE = Path(__file__).parent / "reference" / "parameters.md"
COMMON = "simulator, recorder and scene publisher"
"""The nodes that have the parameters of frames; each of these nodes also has parameters of its own."""
KINDS = {
    COMMON: FrameParameters,
    "rpf3d_simulator": SimulatorParameters,
    "rpf3d_recorder": RecorderParameters,
    "rpf3d_scene_publisher": ScenePublisherParameters,
    "rpf3d_alarm_bridge": AlarmBridgeParameters,
}
SCENE = "scene"
WITHOUT_EFFECT = ("terrain.crs",)
"""Parameters of a scene that the simulator accepts but does not use; the table leaves them out."""
BOUNDS = {"gt": "above {:g}", "ge": "from {:g}", "lt": "to below {:g}", "le": "to {:g}"}
BEGIN, END = "<!-- parameters: {} -->\n", "<!-- end -->"
"""Comments before and after each list or table; this program writes the lines between them."""


def with_tables(page: str) -> str:
    """Return the text of a page with its lists and its table replaced by those of the code."""
    for name in (*KINDS, SCENE):
        begin, parameters = BEGIN.format(name), parameters_of(name)
        before, _, after = page.partition(begin)
        page = f"{before}{begin}{parameters}\n{after[after.index(END) :]}"
    return page


def parameters_of(name: str) -> str:
    """Return the parameters of a node as a list, or of a scene as a table; name : a key of KINDS, or SCENE."""
    return _scene_table() if name == SCENE else _list(name)


def _list(name: str) -> str:
    """Return the Markdown list of the parameters of a node, without the parameters in the list COMMON."""
    common = {each.name for each in fields(FrameParameters)} if name != COMMON else set()
    return "\n".join(
        item(f"**`{each.name}`** (default: `{_shown(each.default)}`{_range(each.metadata)}): "
             f"{each.metadata['description']}") for each in fields(KINDS[name]) if each.name not in common
    )  # fmt: skip


def _range(about: Any) -> str:
    """Return the choices or the range of a parameter, to follow its default; "" if the parameter has neither."""
    if about["choices"]:
        return f"; one of: {', '.join(about['choices'])}"
    return "" if about["low"] is None else f"; {about['low']:g} to {about['high']:g}"


def _scene_table() -> str:
    lines = [
        f"| `{field.key}` | {field.kind.__name__ if field.kind else ''} | {_default(field)} | {_limits(field)} |"
        for field in live_parameters()
        if field.key not in WITHOUT_EFFECT
    ]
    return "\n".join(["| parameter | type | default | range |", "|---|---|---|---|", *lines])


def _default(field: SceneField) -> str:
    if field.default is None:
        return "not set"
    return f"not set ({_shown(field.default)})" if field.within else _shown(field.default)


def _limits(field: SceneField) -> str:
    """Return the range of a field, or its choices without the models that a live scene refuses, such as `rigid`."""
    if field.choices:
        return ", ".join(str(each) for each in field.choices if why_excluded(f"{field.key}.{each}") is None)
    return " ".join(BOUNDS[kind].format(bound) for kind, bound in (field.bounds or {}).items())


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(str, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value) or '""'


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
