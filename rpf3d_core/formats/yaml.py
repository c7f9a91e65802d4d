"""Reader of a YAML file as plain values, with the line of every key for error messages.

The reader takes only the YAML that scene files use: mappings, sequences and plain scalars by the YAML 1.2 core rules
(so `1e-4` is a number and `no` a word), no tags and no aliases. A repeated key is a fault and does not silently
overwrite the first one.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from rpf3d_core.errors import SceneError

KeyPath = tuple[str | int, ...]

WORDS = {"": None, "~": None, "null": None, "true": True, "false": False}
INTEGER = re.compile(r"[-+]?[0-9]+")
NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
NO_NUMBER = re.compile(r"[-+]?\.inf|\.nan", re.IGNORECASE)
PLAIN_TAGS = {f"tag:yaml.org,2002:{kind}" for kind in ("str", "seq", "map")}


class Fault(NamedTuple):
    """A fault of a file: its line (from 1), and a sentence."""

    line: int
    sentence: str


class Document(NamedTuple):
    """A file's values (mappings as dict, sequences as tuple), the line of every key path, and the faults found.

    kind : the kind of file in messages, such as "scene"
    """

    values: Any
    lines: dict[KeyPath, int]
    faults: list[Fault]
    kind: str = "scene"


class _Composer(yaml.BaseLoader):
    """A YAML composer that keeps nodes with their lines, creates no objects and refuses aliases.

    An alias could repeat its target without end.
    """

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            mark = self.get_event().start_mark  # type: ignore[no-untyped-call]
            problem = "aliases (*name) are not read here; write the values out"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)
        return super().compose_node(parent, index)


def read_yaml(path: Path, kind: str = "scene") -> Document:
    """Read a YAML file of one document; `kind` is the kind of file in messages, such as "scene".

    Raises
    ------
    SceneError
        If the file cannot be opened, is not UTF-8 text or is not YAML; names the file and, if known, the line.
    """
    document = Document(None, {}, [], kind)
    try:
        root = yaml.compose(_text(path, kind), Loader=_Composer)
        return document if root is None else document._replace(values=_value(root, (), document))
    except yaml.YAMLError as error:
        raise SceneError(_yaml_sentence(path, error)) from None
    except RecursionError:
        raise SceneError(f"{path}: is nested too deeply to be a {kind} file") from None


def key_name(path: KeyPath) -> str:
    """Return a key path in the usual notation: `sources[0].velocity`."""
    name = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return name.removeprefix(".") or "scene"


def _text(path: Path, kind: str) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"{path}: there is no such {kind} file") from None
    except OSError as error:
        raise SceneError(f"{path}: cannot be read as a {kind} file: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: byte {error.start} is not UTF-8 text, so this is no {kind} file") from None


def _yaml_sentence(path: Path, error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    where = f"{path}, line {mark.line + 1}" if mark else str(path)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    context = getattr(error, "context", None)
    return f"{where}: not valid YAML: {problem}" + (f" ({context})" if context else "")


def _value(node: yaml.Node, path: KeyPath, document: Document) -> Any:
    line = node.start_mark.line + 1
    document.lines.setdefault(path, line)
    if node.tag not in PLAIN_TAGS:
        document.faults.append(Fault(line, f"`{key_name(path)}` has the tag {node.tag}, but tags are not read here"))
        return None
    if isinstance(node, yaml.MappingNode):
        return _mapping(node, path, document)
    if isinstance(node, yaml.SequenceNode):
        return tuple(_value(item, (*path, i), document) for i, item in enumerate(node.value))
    is_plain = isinstance(node, yaml.ScalarNode) and node.style is None
    return _scalar(node.value) if is_plain else node.value


def _mapping(node: yaml.MappingNode, path: KeyPath, document: Document) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for key, item in node.value:
        line = key.start_mark.line + 1
        if not isinstance(key, yaml.ScalarNode):
            document.faults.append(Fault(line, f"a key in `{key_name(path)}` is not a word"))
            continue
        full = (*path, key.value)
        if key.value in values:
            first = document.lines[full]
            document.faults.append(Fault(line, f"`{key_name(full)}` is given twice, first in line {first}"))
            continue
        document.lines[full] = line
        values[key.value] = _value(item, full, document)
    return values


def _scalar(text: str) -> Any:
    if text.lower() in WORDS:
        return WORDS[text.lower()]
    if NO_NUMBER.fullmatch(text):
        return float(text.replace(".", "", 1))
    if INTEGER.fullmatch(text) and len(text) < 100:  # a longer word becomes a float
        return int(text)
    return float(text) if NUMBER.fullmatch(text) else text
