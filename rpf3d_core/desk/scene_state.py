"""The state of the scene that the user edits: its text, its earlier texts, and its file.

If an edit would make the scene invalid, the edit is refused with the message of `rpf3d check`, and the text does not
change.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.desk.runner import Written
from rpf3d_core.desk.whole_files import check_target, write_whole
from rpf3d_core.errors import InputError
from rpf3d_core.formats.yaml import parse_yaml
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_of_text

SUFFIX = "_desk"
"""Suffix of the default name under which a scene is saved, so that the opened file is not replaced."""


class SceneState(NamedTuple):
    """The scene that the user edits: its text, its file and its earlier texts.

    path : path of the scene file; text : the edited text; saved : the text in the scene file
    before : the texts before each edit, oldest first
    """

    path: Path
    text: str
    saved: str
    before: tuple[str, ...] = ()

    @property
    def unsaved(self) -> bool:
        """True if the text differs from the file."""
        return self.text != self.saved

    @property
    def written(self) -> Written:
        """Text and path of the scene, for the runner."""
        return Written(text=self.text, path=self.path)

    @property
    def scene(self) -> Scene:
        """The scene that the text describes; keys that the text does not state have their defaults."""
        return scene_of_text(self.text, self.path)

    @property
    def values(self) -> dict[str, Any]:
        """The plain values that the text states, by key."""
        return dict(parse_yaml(self.text, self.path).values)

    @property
    def default_path(self) -> Path:
        """The path where the scene is saved by default: next to the opened file, with the suffix `_desk` in its name.

        If the opened file already has this suffix, the result is its own path, with the ending .yaml.
        """
        stem = self.path.stem if self.path.stem.endswith(SUFFIX) else f"{self.path.stem}{SUFFIX}"
        return self.path.with_name(f"{stem}.yaml")

    @property
    def report_path(self) -> Path:
        """The path where the report is written by default: next to the scene file, `<scene>_report.html`."""
        return self.path.with_name(f"{self.path.stem}_report.html")

    def edited(self, edit: Callable[[str], str]) -> "SceneState":
        """Return the state after an edit of the text.

        edit : function that takes the text and returns the changed text

        Raises
        ------
        InputError
            The edit cannot be made, or the result is not a valid scene.
        """
        text = edit(self.text)
        scene_of_text(text, self.path)
        return self if text == self.text else self._replace(text=text, before=(*self.before, self.text))

    def undone(self) -> "SceneState":
        """Return the state before the last edit; the same state if there was no edit."""
        return self._replace(text=self.before[-1], before=self.before[:-1]) if self.before else self


def opened(path: Path) -> SceneState:
    """Return the state of a newly opened scene file; errors are as in `read_scene`."""
    path = path.resolve()
    read_scene(path)
    text = path.read_text(encoding="utf-8-sig")
    return SceneState(path=path, text=text, saved=text)


def saved(state: SceneState, path: Path, replace: bool) -> SceneState:
    """Write the scene to a file, and return the state of the scene in this file.

    replace : True to replace an existing file

    Raises
    ------
    InputError
        The path does not end in .yaml or .yml; its folder does not exist; the file exists and must not be replaced; or
        the file cannot be written. Or the scene names a file by a relative path, and no such file exists relative to
        the folder in which the scene would be saved.
    """
    path = path.resolve()
    if path.suffix.lower() not in (".yaml", ".yml"):
        raise InputError(f"{path}: a scene file ends in .yaml")
    check_target(path, replace)
    scene_of_text(state.text, path)  # paths in the scene are relative to its folder
    write_whole(path, state.text)
    return state._replace(path=path, saved=state.text)


def shown_path(path: Path) -> str:
    """Return a path as the user types it: relative to the folder where the desk was started, if inside this folder."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)
