"""Read a YAML file as plain values, with the line of every key for error messages.

The reader accepts only mappings, sequences and scalars, without tags. Scalars without quotes follow the core rules of
YAML 1.2 (so `1e-4` is a number and `no` a word), but hexadecimal and octal numbers are words. An alias (*name) is
replaced by a copy of the value with the anchor (&name); all aliases together may repeat MOST_REPEATED values. Merge
keys (<<) are not part of YAML 1.2 and are reported as errors. A repeated key is an error, too: the second value does
not silently replace the first value.
"""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from rpf3d_core.errors import SceneError

KeyPath = tuple[str | int, ...]

UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""First bytes of a text in UTF-16."""
WORDS = {"": None, "~": None, "null": None, "true": True, "false": False}
INTEGER = re.compile(r"[-+]?[0-9]+")
NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
NO_NUMBER = re.compile(r"[-+]?\.inf|\.nan", re.IGNORECASE)
PLAIN_TAGS = {f"tag:yaml.org,2002:{kind}" for kind in ("str", "seq", "map")}

MERGE_KEY = "<<"
MOST_REPEATED = 100_000
"""Largest number of values that all aliases of a YAML file together may repeat.

Values are numbers, words, lists and mappings. Nested aliases repeat exponentially many values, so a few lines could
fill the memory.
"""


class Fault(NamedTuple):
    """An error in a YAML file: its line (from 1), and a sentence for the user."""

    line: int
    sentence: str


def report_of(path: Path, faults: Iterable[Fault]) -> str:
    """Return the errors of a file as a message: a line for each error, in the order of the file, without duplicates."""
    return "\n".join(f"{path}, line {line}: {sentence}" for line, sentence in sorted(set(faults)))


class Document(NamedTuple):
    """The content of a YAML file: its values, their lines, and its errors.

    values : mappings are dicts, sequences are tuples; None for an empty file
    lines : line (from 1) of each key and of each item of a sequence, by key path; () is the key path of the whole file
    kind : the kind of file in messages, such as "scene"
    """

    values: Any
    lines: dict[KeyPath, int]
    faults: list[Fault]
    kind: str = "scene"


class _Alias(yaml.Node):
    """An alias (*name) in a YAML file, with its own line; value : the node with the anchor (&name)."""

    def __init__(self, name: str, value: yaml.Node, mark: yaml.Mark) -> None:
        super().__init__(value.tag, value, mark, mark)
        self.name = name


class _RefusedAlias(yaml.MarkedYAMLError):
    """Error for an alias that is valid YAML but refused here, because it repeats too much or contains itself."""

    def __init__(self, alias: _Alias, problem: str) -> None:
        super().__init__(problem=problem, problem_mark=alias.start_mark)


class _Composer(yaml.BaseLoader):
    """A YAML parser that keeps the line of each value and alias, and creates no objects."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        is_alias, event = self.check_event(yaml.AliasEvent), self.peek_event()  # type: ignore[no-untyped-call]
        node: Any = super().compose_node(parent, index)
        return _Alias(event.anchor, node, event.start_mark) if is_alias else node


class _Reading:
    """Converts the nodes of a YAML file into plain values, and counts the values that aliases repeat.

    alias : the alias that is being copied; the outermost one if aliases are nested; None outside aliases
    repeated : number of values that aliases have repeated so far
    """

    def __init__(self, document: Document) -> None:
        self.document = document
        self.alias: _Alias | None = None
        self.repeated = 0
        self._open: list[yaml.Node] = []

    def value(self, node: yaml.Node, path: KeyPath) -> Any:
        """Return the plain values of a YAML node, and store the line of its key and of all keys below it."""
        line = node.start_mark.line + 1
        self.document.lines.setdefault(path, line)
        if isinstance(node, _Alias):
            return self._copy(node, path)
        self._count()
        if node.tag not in PLAIN_TAGS:
            self._fault(line, f"`{key_name(path)}` has the tag {node.tag}, but tags are not read here")
            return None
        if isinstance(node, yaml.ScalarNode):
            return _scalar(node.value) if node.style is None else node.value
        self._open.append(node)
        if isinstance(node, yaml.MappingNode):
            values: Any = self._mapping(node, path)
        else:
            values = tuple(self.value(item, (*path, i)) for i, item in enumerate(node.value))
        self._open.pop()
        return values

    def _copy(self, alias: _Alias, path: KeyPath) -> Any:
        """Return a copy of the values at the anchor of an alias (*name); refuse an alias inside its own anchor."""
        if any(alias.value is node for node in self._open):
            raise _RefusedAlias(alias, f"the alias *{alias.name} stands inside its own anchor, so the value has no end")
        outermost, self.alias = self.alias, self.alias or alias
        values = self.value(alias.value, path)
        self.alias = outermost
        return values

    def _count(self) -> None:
        """Count a value that an alias repeats, and refuse the alias above MOST_REPEATED; do nothing outside aliases."""
        if self.alias is None:
            return
        self.repeated += 1
        if self.repeated > MOST_REPEATED:
            problem = f"the alias *{self.alias.name} brings the values that aliases repeat to more than"
            raise _RefusedAlias(self.alias, f"{problem} {MOST_REPEATED:,}; use fewer aliases")

    def _mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for key, item in node.value:
            line = key.start_mark.line + 1
            if not isinstance(key, yaml.ScalarNode):
                self._fault(line, f"a key in `{key_name(path)}` is not a word")
                continue
            full = (*path, key.value)
            if key.value == MERGE_KEY and key.style is None:
                self._fault(line, f"`{key_name(full)}` is a merge key, but these are not read here; write the keys out")
                continue
            if key.value in values:
                first = self.document.lines[full]
                self._fault(line, f"`{key_name(full)}` is given twice, first in line {first}")
                continue
            self.document.lines[full] = line
            values[key.value] = self.value(item, full)
        return values

    def _fault(self, line: int, sentence: str) -> None:
        self.document.faults.append(Fault(line, sentence))


def read_yaml(path: Path, kind: str = "scene") -> Document:
    """Read a YAML file of one document as plain values with line numbers; errors are collected in the result.

    kind : the kind of file in messages, such as "scene"

    Raises
    ------
    SceneError
        The file cannot be opened, is not UTF-8 text or is not YAML; the message names the file and, if known, the line.
    """
    return parse_yaml(_text(path, kind), path, kind)


def place_in_file(path: Path, key: KeyPath) -> str:
    """Return the file and line of a key, as the beginning of a message: "scene.yaml, line 6".

    The result is the path alone if the file cannot be read or does not have the key.
    """
    try:
        line = read_yaml(path).lines.get(key)
    except SceneError:
        line = None
    return str(path) if line is None else f"{path}, line {line}"


def parse_yaml(text: str, path: Path, kind: str = "scene") -> Document:
    """Parse the text of a YAML file with one document, as `read_yaml` does; `path` and `kind` are used in messages.

    Raises
    ------
    SceneError
        The text is not YAML, or is nested too deeply.
    """
    try:
        return _document(text, kind)
    except yaml.YAMLError as error:
        raise SceneError(_yaml_sentence(path, error)) from None
    except RecursionError:
        raise SceneError(f"{path}: is nested too deeply to be a {kind} file") from None


def yaml_values(text: str, name: str) -> Any:
    """Return the plain values of a YAML text that is not from a file.

    name : text that messages about refused values show in place of a path; the message for a text that is not YAML has
        no name

    Raises
    ------
    SceneError
        The text is not YAML, or has a value that is not allowed in scene files.
    """
    try:
        document = _document(text)
    except (yaml.YAMLError, RecursionError) as error:
        raise SceneError(f"not valid YAML: {getattr(error, 'problem', None) or type(error).__name__}") from None
    if document.faults:
        raise SceneError(report_of(Path(name), document.faults))
    return document.values


def _document(text: str, kind: str = "scene") -> Document:
    """Return the text of a YAML file as plain values with line numbers; raise YAMLError if it is not YAML."""
    document = Document(values=None, lines={}, faults=[], kind=kind)
    root = yaml.compose(text, Loader=_Composer)
    return document if root is None else document._replace(values=_Reading(document).value(root, ()))


def yaml_text(values: Any) -> str:
    """Return plain values (mappings, sequences, numbers, words) as the text of a YAML file; keys keep their order."""
    return yaml.safe_dump(values, sort_keys=False, default_flow_style=None, allow_unicode=True, width=110)


def key_name(path: KeyPath) -> str:
    """Return the place of a value in a YAML file, such as `sources[0].velocity`; "scene" for the root."""
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
        if b"\0" in error.object and not error.object.startswith(UTF_16):
            raise SceneError(f"{path}: is not a text file, so this is no {kind} file") from None
        raise SceneError(
            f"{path}: byte {error.start} is not UTF-8 text; if this is a {kind} file, save it as UTF-8 in a text editor"
        ) from None


def _yaml_sentence(path: Path, error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    where = f"{path}, line {mark.line + 1}" if mark else str(path)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    context = getattr(error, "context", None)
    invalid = "" if isinstance(error, _RefusedAlias) else "not valid YAML: "
    return f"{where}: {invalid}{problem}" + (f" ({context})" if context else "")


def _scalar(text: str) -> Any:
    if text.lower() in WORDS:
        return WORDS[text.lower()]
    if NO_NUMBER.fullmatch(text):
        return float(text.replace(".", "", 1))
    if INTEGER.fullmatch(text) and len(text) < 100:  # a longer number becomes a float
        return int(text)
    return float(text) if NUMBER.fullmatch(text) else text
