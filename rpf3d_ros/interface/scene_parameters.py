"""Declare the fields of a scene as parameters of the simulator; the fields are read from the scene's model."""

import sys
from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from rpf3d_core.live.scene import SCENE, live_parameters, live_scene
from rpf3d_core.scene.listings.fields import SceneField

LARGEST_INTEGER = 2**63 - 1
"""Largest integer of a ROS parameter."""

TYPES = {
    bool: Parameter.Type.BOOL,
    int: Parameter.Type.INTEGER,
    float: Parameter.Type.DOUBLE,
    str: Parameter.Type.STRING,
}
ABOUT_SCENE = "path of a scene file with all settings; the parameters named as keys of a scene must then not be set"


class SceneParameters:
    """The fields of a scene as parameters of the simulator node, and the values that were given for them."""

    def __init__(self, node: Node) -> None:
        """Declare all fields. Raises InputError, with a line for each wrong parameter, if the scene is not valid."""
        self._node = node
        self._fields = {field.key: field for field in live_parameters()}
        given = {name: value for name in (SCENE, *self._fields) if (value := _override(node, name)) not in (None, "")}
        live_scene(given)  # reports all faults, in the words of a scene; rclpy would report only the first
        self._given = set(given)
        about = ParameterDescriptor(description=ABOUT_SCENE)
        node.declare_parameter(SCENE, given.get(SCENE, ""), about, ignore_override=True)
        for field in self._fields.values():
            self._declare(field, given)
        node.add_post_set_parameters_callback(self._note)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all parameters of the scene: the path of a scene file, and the scene's fields."""
        return (SCENE, *self._fields)

    @property
    def given(self) -> dict[str, Any]:
        """The values that a user gave on the command line, in a parameter file or later, by name of the parameter.

        All other parameters have the scene's default.
        """
        return {name: self._node.get_parameter(name).value for name in self.names if name in self._given}

    def _declare(self, field: SceneField, given: Mapping[str, Any]) -> None:
        value = given.get(field.key, None if field.within else field.default)
        start = TYPES[_kind(field)] if value is None else _kind(field)(value)
        self._node.declare_parameter(field.key, start, descriptor_of(field), ignore_override=True)

    def _note(self, parameters: list[Parameter]) -> None:
        for each in parameters:
            if each.name in self._fields or each.name == SCENE:
                (self._given.discard if each.value in (None, "") else self._given.add)(each.name)


def descriptor_of(field: SceneField) -> ParameterDescriptor:
    """Return the description, range and choices of a scene field, as ROS tools show them.

    A range in ROS includes both ends. If the scene's model excludes an end, `additional_constraints` states this, and
    the scene refuses this value.
    """
    about = ParameterDescriptor(description=_description(field), additional_constraints="; ".join(_constraints(field)))
    bounds = field.bounds or {}
    low, high = bounds.get("ge", bounds.get("gt")), bounds.get("le", bounds.get("lt"))
    if low is None and high is None:
        return about
    if field.kind is int:
        ends = (int(-LARGEST_INTEGER if low is None else low), int(LARGEST_INTEGER if high is None else high))
        about.integer_range = [IntegerRange(from_value=ends[0], to_value=ends[1])]
    else:
        largest = sys.float_info.max
        reals = (float(-largest if low is None else low), float(largest if high is None else high))
        about.floating_point_range = [FloatingPointRange(from_value=reals[0], to_value=reals[1])]
    return about


def _description(field: SceneField) -> str:
    if not field.within or field.names:
        return field.description
    default = "" if field.default is None else f", {field.default} where it is named and this is not set"
    return f"{field.description}; setting it names `{field.within}`{default}"


def _constraints(field: SceneField) -> list[str]:
    bounds = field.bounds or {}
    ends = [f"not {bounds[kind]:g} itself" for kind in ("gt", "lt") if kind in bounds]
    choices = [f"one of {', '.join(map(str, field.choices))}"] if field.choices else []
    return [*ends, *choices]


def _kind(field: SceneField) -> type:
    assert field.kind is not None, field.key  # `live_parameters` has only fields of a parameter's types
    return field.kind


def _override(node: Node, name: str) -> Any:
    """Return the value of a parameter from the command line or a parameter file, before its type is checked.

    The value is None if none was given. The parameter is declared without a type for this call only, because the
    scene's model checks the value.
    """
    if not node.has_parameter(name):
        node.declare_parameter(name, None, ParameterDescriptor(dynamic_typing=True))
    value = node.get_parameter(name).value
    node.undeclare_parameter(name)
    return value
