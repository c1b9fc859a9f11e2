# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node whose parameters are frozen, validated sets that change between ticks only."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar, TypeVar, cast

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter

from dmp_cpg_ros.core.certificates.gate import shown
from dmp_cpg_ros.core.errors import DataError, DmpCpgError, ParameterError
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.suite_parameters import OWNER
from dmp_cpg_ros.nodes.hooked_lifecycle import HookedLifecycleNode
from dmp_cpg_ros.nodes.ros_parameters import (
    NodeParameters,
    ParameterTable,
    declare,
    plain,
    ros_value,
)

P = TypeVar('P', bound=Parameters)
Sets = Mapping[type[Parameters], Parameters]


class ParameterizedNode(HookedLifecycleNode):
    """A node with declared, checked parameters.

    Attributes
    ----------
    KIND : str
        Kind of node in the interfaces table, also the name of its executable.
    PARAMETER_SETS : tuple of Parameters classes
        Parameter sets beyond :class:`~dmp_cpg_ros.nodes.ros_parameters.NodeParameters`.
    CHANGEABLE : collection of str
        Parameters that may change while the node runs; all others are read-only. Those that
        another node owns are refused with its name, and change only by :meth:`follow`.
    """

    KIND: ClassVar[str] = ''
    PARAMETER_SETS: ClassVar[tuple[type[Parameters], ...]] = ()
    CHANGEABLE: ClassVar[Collection[str]] = ()

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node and check its parameters; raises ParameterError for a bad one."""
        self._following = False
        super().__init__(name or self.KIND, **options)
        self._table = self.parameter_table()
        self._sets = self._accepted = declare(self, self._table)
        self.add_on_set_parameters_callback(self._check_change)
        self.add_post_set_parameters_callback(self._accept_change)

    def on_parameters(self) -> None:
        """Take over changed parameters from :meth:`parameters_of`, at the start of a tick."""

    def check_parameters(self, sets: Sets) -> None:
        """Raise ParameterError to refuse a change that every field by itself would allow."""

    @classmethod
    def parameter_table(cls) -> ParameterTable:
        """All parameters of this kind of node."""
        return ParameterTable((NodeParameters, *cls.PARAMETER_SETS), cls.CHANGEABLE)

    @classmethod
    def default_name(cls, arguments: Sequence[str]) -> str:
        """Name of the node when the command line does not give one."""
        return cls.KIND

    def parameters_of(self, parameter_set: type[P]) -> P:
        """Return the values in effect of one parameter set."""
        return cast(P, self._sets[parameter_set])

    def start(self) -> None:
        """Configure and activate, unless ``autostart`` is false; raises what made that fail."""
        if self.parameters_of(NodeParameters).autostart:
            super().start()

    def take_changed_parameters(self) -> None:
        """Let changes that were accepted since the last call take effect, all at once."""
        if self._accepted is not self._sets:
            self._sets = self._accepted
            self.on_parameters()

    def follow(self, values: Mapping[str, Any]) -> None:
        """Take over what the owner of some parameters has accepted, where it is new.

        Raises
        ------
        DataError
            If it cannot be taken over; nothing is then changed.
        """
        accepted = self._table.values(self._accepted)
        news = {name: value for name, value in values.items()
                if name in accepted and value != ros_value(accepted[name])}
        if not news:
            return
        self._following = True
        try:
            result = self.set_parameters_atomically(
                [Parameter(name, value=value) for name, value in news.items()])
        finally:
            self._following = False
        if not result.successful:
            raise DataError(f'cannot follow {news}: {result.reason}')

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters; read-only ones may be set to the value that they have.

        So a file that ``ros2 param dump`` wrote can be loaded by the node that it describes.
        """
        news = [entry for entry in parameter_list if not self._is_fixed(entry)]
        if parameter_list and not news:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(news)

    def _is_fixed(self, entry: Parameter) -> bool:
        """Whether a parameter is read-only and has this value."""
        return (self.has_parameter(entry.name) and self.describe_parameter(entry.name).read_only
                and self.get_parameter(entry.name).get_parameter_value()
                == entry.get_parameter_value())

    def _refuse_foreign(self, sets: Sets) -> None:
        before, after = self._table.values(self._accepted), self._table.values(sets)
        for name, value in after.items():
            owner = OWNER.get(name, self.KIND)
            if value != before[name] and owner != self.KIND:
                raise ParameterError(
                    f"'{name}' belongs to {owner}, which the other nodes follow; set it there: "
                    f'ros2 param set /{owner} {name} {shown(value)}')

    def _check_change(self, changes: list[Parameter]) -> SetParametersResult:
        """Validate changes together with the values that were accepted last."""
        try:
            sets = self._changed(changes)
            if not self._following:
                self._refuse_foreign(sets)
            self.check_parameters(sets)
        except DmpCpgError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept_change(self, changes: list[Parameter]) -> None:
        self._accepted = self._changed(changes)
        if not self.configured:
            self._sets = self._accepted

    def _changed(self, changes: list[Parameter]) -> dict[type[Parameters], Parameters]:
        values = self._table.values(self._accepted)
        values.update({change.name: plain(change.value) for change in changes
                       if change.name in self._table.fields})
        return self._table.build(values)
