"""The parameters of the node, declared with their meanings and ranges."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any, Final

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from flatland.node.parameters import NodeParameters, Ros2Parameters

USE_SIM_TIME: Final = "use_sim_time"
_MESSAGE_PACKAGE: Final = "msgs_package"  # a choice of ROS 1 only
_CHANGED_BY: Final = {"update_rate": "the service set_rate changes it"}


def fields() -> Iterator[dataclasses.Field[Any]]:
    """Returns the descriptions of all parameters."""
    for table in (NodeParameters, Ros2Parameters):
        for field in dataclasses.fields(table):
            if field.name != _MESSAGE_PACKAGE:
                yield field


class DeclaredParameters:
    """The parameters of a node, which are read at its start.

    A value that the user has given may have any type until it is checked: `-p update_rate:=100`
    sets an integer.
    """

    def __init__(self, node: Node) -> None:
        """Declares all parameters of the tables.

        Args:
            node: The node, whose time source is detached.
        """
        self._node = node
        self._is_setting = False  # whether the node itself sets a parameter
        # The values of the command line and of parameter files, also of undeclared parameters.
        self._given: dict[str, Parameter] = node._parameter_overrides
        for field in fields():
            if field.name != USE_SIM_TIME:  # which rclpy declares
                descriptor = ParameterDescriptor(dynamic_typing=True)
                node.declare_parameter(field.name, _sendable(field.default), descriptor)

    def get(self, name: str) -> Any:
        """Returns a parameter as the user has set it, None if it is not set.

        Args:
            name: Name of the parameter, with slashes or dots between the parts.
        """
        given = self._given.get(name.replace("/", "."))
        return None if given is None else given.value

    def describe(self, *tables: object) -> None:
        """Sets the values that are in effect, and what describes them; refuses later changes.

        Args:
            tables: `NodeParameters` and `Ros2Parameters` as they were read.
        """
        values: dict[str, Any] = {}
        for table in tables:
            values |= {each.name: getattr(table, each.name) for each in dataclasses.fields(table)}  # type: ignore[arg-type]
        for field in fields():
            value = _sendable(values[field.name])
            if value is not None:
                self.set(field.name, value)
            self._node.set_descriptor(field.name, _descriptor(field))
        self._node.add_on_set_parameters_callback(self._refuse)

    def set(self, name: str, value: object) -> None:
        """Sets a parameter of the node."""
        self._is_setting = True
        try:
            self._node.set_parameters([Parameter(name, value=value)])
        finally:
            self._is_setting = False

    def _refuse(self, parameters: list[Parameter]) -> SetParametersResult:
        """Refuses changes of the parameters that are read at the start."""
        names = {field.name for field in fields()}
        for parameter in parameters:
            if parameter.name in names and not self._is_setting:
                reason = f"{parameter.name} is read at the start of the node"
                if parameter.name in _CHANGED_BY:
                    reason += f"; {_CHANGED_BY[parameter.name]}"
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)


def _sendable(value: object) -> object:
    """Converts a value of the tables to the value of a parameter."""
    return list(value) if isinstance(value, tuple) else value


def _descriptor(field: dataclasses.Field[Any]) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        description=field.metadata["meaning"],
        read_only=field.name not in _CHANGED_BY,
        dynamic_typing=True,
    )
    limits = field.metadata["limits"]
    if limits is not None:
        low, high = limits
        if isinstance(low, int):
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high)]
        else:
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    return descriptor
