# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of the parameters of a node, each judged together with all that was accepted before."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterType, SetParametersResult
from rclpy.parameter import Parameter

from dmp_cpg_ros.core.errors import DataError, DmpCpgError, ParameterError
from dmp_cpg_ros.core.parameters import typed
from dmp_cpg_ros.core.suite_parameters import OWNER
from dmp_cpg_ros.nodes.framework import parameters
from dmp_cpg_ros.nodes.framework.judging import InTurn, Step, Steps, beside_ticks

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

VALUE_TYPES = range(ParameterType.PARAMETER_NOT_SET, ParameterType.PARAMETER_STRING_ARRAY + 1)
"""Types of values that a request may have."""

MOST_VERDICTS = 8
"""How often a change is judged anew because what runs has become another meanwhile."""


class ParameterChanges:
    """What a node does when its parameters are to change.

    Parameters
    ----------
    node : SuiteNode
        Whose parameters are declared here; raises ParameterError for a bad one.

    Attributes
    ----------
    accepted : mapping from class to instance
        Parameters that were accepted last; they take effect at the next tick.
    following : bool
        Whether the change that is judged is one that its owner has accepted.
    """

    def __init__(self, node: SuiteNode) -> None:
        """Declare the parameters, and take what is asked of them."""
        self._node, self._table = node, node.parameter_table()
        self.accepted: parameters.Sets = parameters.declare(node, self._table)
        self.following = False
        self._in_turn = InTurn(partial(beside_ticks, node))
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._accept)

    def follow(self, values: Mapping[str, Any]) -> bool:
        """Take over what the owner of some parameters has accepted; returns whether it is new.

        Raises
        ------
        DataError
            If it cannot be taken over; nothing is then changed.
        """
        known = self._table.values(self.accepted)
        news = {name: value for name, value in values.items()
                if name in known and value != parameters.plain(known[name])}
        if not news:
            return False
        self.following = True
        try:
            result = self._node.set_parameters_atomically(
                [Parameter(name, value=value) for name, value in news.items()])
        finally:
            self.following = False
        if not result.successful:
            raise DataError(f'cannot follow {news}: {result.reason}')
        return True

    def take(self, make: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        """Change parameters when what the certificate says of it has been found beside the ticks;
        changes take their turn.
        """
        return self._in_turn.take(self._steps(make, request, response), response)

    def _steps(self, make: Callable[[Any, Any], Any], request: Any, response: Any) -> Steps:
        entries, one_by_one = list(request.parameters), hasattr(response, 'results')
        for group in [[entry] for entry in entries] if one_by_one else [entries]:
            result = yield from self._refusal(group)
            if result is None:
                try:
                    made = make(type(request)(parameters=group), type(response)())
                    result = made.results[0] if one_by_one else made.result
                except Exception as error:  # noqa: BLE001 - each parameter has its answer
                    result = self._refused(error)
            if one_by_one:
                response.results.append(result)
            else:
                response.result = result

    def _refusal(self, group: Sequence[Any]) -> Generator[Step, None, SetParametersResult | None]:
        """Have what a change is judged by computed; why it is refused where that is impossible."""
        try:
            for entry in group:
                self._check_entry(entry)
            for _ in range(MOST_VERDICTS):
                asked = self._to_judge(group)
                if asked is None:
                    break
                yield asked
        except Exception as error:  # noqa: BLE001 - whatever it is, the request is answered
            return self._refused(error)
        return None

    def _refused(self, error: Exception) -> SetParametersResult:
        expected = isinstance(error, DmpCpgError)
        reason = str(error) if expected else self._node.drop('set_parameters', error)
        return SetParametersResult(successful=False, reason=reason)

    def _check_entry(self, entry: Any) -> None:
        """Raise ParameterError for what rclpy refuses without a word of what is wrong."""
        if not self._node.has_parameter(entry.name):
            raise ParameterError(self._table.unknown(entry.name))
        if entry.value.type not in VALUE_TYPES:
            raise ParameterError(f"the value of '{entry.name}' has the type {entry.value.type}; "
                                 f'valid are {min(VALUE_TYPES)} to {max(VALUE_TYPES)}')
        own = self._node.get_parameter(entry.name).get_parameter_value()
        if entry.value != own and self._node.describe_parameter(entry.name).read_only:
            raise ParameterError(
                f"'{entry.name}' is read-only while {self._node.get_name()} runs: start it with "
                f'{entry.name}:=...; what may change is '
                f'{", ".join(sorted(self._table.changeable)) or "nothing"}')

    def _to_judge(self, entries: Sequence[Any]) -> Step | None:
        """What has to be computed before a change can be judged at once."""
        certified = self._node.certified
        if certified is None or self._node.lock_step:
            return None
        try:
            sets = self._changed([Parameter.from_parameter_msg(entry) for entry in entries])
            return certified.to_judge(sets)
        except Exception:  # noqa: BLE001 - whatever it is, the change itself will say so
            return None

    def between(self, sets: parameters.Sets) -> dict[str, Any]:
        """New values of the parameters in which sets differ from those accepted last."""
        before = self._table.values(self.accepted)
        return {name: value for name, value in self._table.values(sets).items()
                if value != before[name]}

    def _check(self, changes: list[Parameter]) -> SetParametersResult:
        """Validate changes together with the values that were accepted last."""
        kind, space = self._node.KIND, self._node.get_namespace().rstrip('/')
        try:
            sets = self._changed(changes)
            for name, value in self.between(sets).items() if not self.following else ():
                owner = OWNER.get(name, kind)
                if owner != kind:
                    raise ParameterError(
                        f"'{name}' belongs to {owner}, which the other nodes follow; set it "
                        f'there: ros2 param set {space}/{owner} {name} {typed(value)}')
            self._node.check_parameters(sets)
        except DmpCpgError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept(self, changes: list[Parameter]) -> None:
        self.accepted = self._changed(changes)
        self._node.take_over()

    def _changed(self, changes: list[Parameter]) -> parameters.Sets:
        return self._table.build({**self._table.values(self.accepted), **{
            change.name: parameters.plain(change.value) for change in changes
            if change.name in self._table.fields}})
