"""Declare the fields of a dataclass as ROS parameters of a node, read their values, and refuse later changes.

A node reads its parameters at its start; afterwards they are read-only. The simulator, which may be configured several
times, accepts new values while it is not configured (`ParameterLock`).
"""

from array import array
from collections.abc import Sequence
from dataclasses import MISSING, Field, fields
from difflib import get_close_matches
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from rpf3d_core.errors import InputError

ROS_OWN = ("use_sim_time", "start_type_description_service", "qos_overrides")
"""Parameters that rclpy declares by itself."""

SHARED = ("source_topics", "source_cloud_topics")
"""Parameters that a file sets for all nodes (`/**`), so that all nodes use the same values.

A node that does not have these parameters prints no warning.
"""

SIM_TIME = "use_sim_time"
"""Parameter of rclpy that chooses the node's clock: simulated time, or the time of the machine."""

P = TypeVar("P")


def declare(node: Node, kind: type[P], fixed: bool = True, others: Sequence[str] = ()) -> P:
    """Declare a node's parameters from the fields of a dataclass, and return their values.

    kind : the dataclass, such as RecorderParameters
    fixed : True if the parameters are read-only from now on
    others : names of parameters that are declared elsewhere, and therefore known

    Raises InputError with the name of the parameter for a wrong type, a value outside its range, or an unknown choice.
    A given parameter that is not declared causes a warning with the most similar name.
    """
    for each in fields(kind):  # type: ignore[arg-type]
        _declare(node, each, fixed)
    _warn_of_unknown(node, [*(each.name for each in fields(kind)), *others])  # type: ignore[arg-type]
    if fixed:
        ParameterLock(node, is_forever=True)
    return values_of(node, kind)


def values_of(node: Node, kind: type[P]) -> P:
    """Return the current values of declared parameters. Raises InputError for an unknown choice."""
    return kind(**{each.name: _value(node, each) for each in fields(kind)})  # type: ignore[arg-type]


class ParameterLock:
    """Refuses changes of a node's parameters while the node is configured or, for some nodes, always.

    The configuration uses the values that the parameters had when the node was configured. `use_sim_time` is locked,
    too, because with another clock all stamps and ages would mean something else. The other parameters of rclpy
    are read-only, or have no effect on decisions.
    """

    def __init__(self, node: Node, free: Sequence[str] = (), is_forever: bool = False) -> None:
        """Start to check all changes of the node's parameters; changes are refused while attribute `closed` is True.

        free : parameters that may be set at any time
        is_forever : True for a node without a configured state: its parameters never change, and `closed` is True
        """
        self.closed = is_forever
        self._while = (
            "runs: restart the node with the new values"
            if is_forever
            else "is configured: clean up the node, set the parameters, and configure the node"
        )
        self._node, self._free = node, frozenset(free)
        node.add_on_set_parameters_callback(self._check)

    def _check(self, parameters: list[Parameter]) -> SetParametersResult:
        kept = [each.name for each in parameters if each.name not in self._free and self._is_locked(each)]
        if not self.closed or not kept:
            return SetParametersResult(successful=True)
        sentence = f"{', '.join(kept)} cannot change while the node {self._while}"
        return SetParametersResult(successful=False, reason=sentence)

    def _is_locked(self, given: Parameter) -> bool:
        if given.name == SIM_TIME:
            return bool(given.value != self._node.get_parameter(SIM_TIME).value)
        return not _is_ros_own(given.name)


def descriptor(about: Field[Any], fixed: bool = True) -> ParameterDescriptor:
    """Return the description, range and choices of a parameter, as ROS tools show them.

    about : dataclass field of the parameter; fixed : True if the parameter is read-only
    """
    meta = about.metadata
    described = ParameterDescriptor(description=meta["description"], read_only=fixed)
    if meta["choices"]:
        described.additional_constraints = "one of " + ", ".join(meta["choices"])
    if meta["low"] is None:
        return described
    if about.type in (int, "int"):
        described.integer_range = [IntegerRange(from_value=meta["low"], to_value=meta["high"])]
    else:
        described.floating_point_range = [FloatingPointRange(from_value=meta["low"], to_value=meta["high"])]
    return described


def _declare(node: Node, about: Field[Any], fixed: bool) -> None:
    assert about.default is not MISSING, about.name
    try:
        node.declare_parameter(about.name, _as_ros(about.default), descriptor(about, fixed))
    except (InvalidParameterTypeException, InvalidParameterValueException) as error:
        raise InputError(_why_refused(node, about)) from error


def _why_refused(node: Node, about: Field[Any]) -> str:
    """Return a sentence about the given value of a parameter, which has the wrong type or is outside its range."""
    given = _given(node)[about.name].value
    sentence, kind = f"parameter {about.name} is {given!r}; it must be", _kind(_as_ros(about.default))
    if _kind(given) == kind:
        low, high = about.metadata["low"], about.metadata["high"]
        return f"{sentence} from {low:g} to {high:g}" if kind == "float" else f"{sentence} from {low} to {high}"
    if _kind(given) == kind.replace("float", "int"):
        floats = [float(each) for each in given] if isinstance(given, (list, array)) else float(given)
        return f"{sentence} {_KINDS[kind]}: write {floats}"
    return f"{sentence} {_KINDS[kind]}"


def _kind(value: Any) -> str:
    """Return the kind of a parameter's value, as a key of `_KINDS` if a parameter may have this kind."""
    if isinstance(value, (list, array)):
        return f"list of {type(value[0]).__name__}" if value else "list"
    return type(value).__name__


_KINDS = {
    "bool": "true or false", "int": "a whole number", "float": "a number with a decimal point", "str": "a text",
    "list of float": "a list of numbers with decimal points", "list of str": "a list of texts",
}  # fmt: skip
"""Words for the type of a parameter, by the Python type of its default."""


def _value(node: Node, about: Field[Any]) -> Any:
    value, choices = node.get_parameter(about.name).value, about.metadata["choices"]
    if choices and value not in choices:
        raise InputError(f"parameter {about.name} is '{value}'; it must be one of {', '.join(choices)}")
    return tuple(value) if isinstance(about.default, tuple) else value


def _as_ros(default: Any) -> Any:
    return list(default) if isinstance(default, tuple) else default


def _warn_of_unknown(node: Node, known: list[str]) -> None:
    for name in _given(node):
        if name not in (*known, *SHARED) and not _is_ros_own(name):
            near = get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            node.get_logger().warning(f"this node has no parameter {name}, so its value has no effect{hint}")


def _given(node: Node) -> dict[str, Parameter]:
    """Return the parameters that the user gave, by name."""
    return getattr(node, "_parameter_overrides", {})  # rclpy has no public name for them


def _is_ros_own(name: str) -> bool:
    return name.split(".")[0] in ROS_OWN
