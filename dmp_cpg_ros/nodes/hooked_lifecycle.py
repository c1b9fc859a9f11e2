# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node whose transitions run hooks that may raise, and say why when they fail."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.nodes.guarded_node import GuardedNode


class HookedLifecycleNode(GuardedNode):
    """A lifecycle node with the hooks ``configure``, ``activate``, ``deactivate``, ``cleanup``.

    ``configure`` and ``activate`` refuse by raising a
    :class:`~dmp_cpg_ros.core.errors.DmpCpgError`: the transition fails, and the log has the text.
    Whatever else a hook raises is an error, after which the node is unconfigured again.

    Attributes
    ----------
    active : bool
        Whether the node is in the state ``active``.
    configured : bool
        Whether it is in the state ``inactive`` or ``active``.
    state_label : str
        Lifecycle state.
    failure : Exception or None
        Why the last transition failed.
    """

    def __init__(self, name: str, **options: Any) -> None:
        """Create the node, unconfigured."""
        super().__init__(name, **options)
        self.active = self.configured = False
        self.state_label = 'unconfigured'
        self.failure: Exception | None = None

    def configure(self) -> None:
        """Build what the parameters describe and create publishers, subscriptions, services."""

    def activate(self) -> None:
        """Get ready for the first message."""

    def deactivate(self) -> None:
        """Stop; messages no longer arrive."""

    def cleanup(self) -> None:
        """Drop what :meth:`configure` built."""

    def destroy_entities(self) -> None:
        """Destroy the publishers, subscriptions and services of :meth:`configure`."""

    def state_changed(self) -> None:
        """Note a new :attr:`state_label`."""

    def start(self) -> None:
        """Configure and activate; raises what made that fail."""
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != TransitionCallbackReturn.SUCCESS:
                raise self.failure or RuntimeError(f'{self.get_name()} could not start')

    def close(self) -> None:
        """End the node's work without transitions, at shutdown; safe to call twice."""
        try:
            if self.active:
                self.active = False
                self.deactivate()
        finally:
            if self.configured:
                self.configured = False
                self.cleanup()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`configure`; what it made is destroyed again when it fails."""
        result = self._run('configure', self.configure)
        self.configured = result == TransitionCallbackReturn.SUCCESS
        if not self.configured:
            self.destroy_entities()
        self._enter('inactive' if self.configured else 'unconfigured')
        return result

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`activate` and let messages in."""
        result = self._run('activate', self.activate)
        self.active = result == TransitionCallbackReturn.SUCCESS
        self._enter('active' if self.active else 'inactive')
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Keep messages out and run :meth:`deactivate`."""
        self.active = False
        result = self._run('deactivate', self.deactivate, may_refuse=False)
        self._enter('inactive')
        return result

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`cleanup` and destroy all entities."""
        self.configured = False
        result = self._run('clean up', self.cleanup, may_refuse=False)
        self.destroy_entities()
        self._enter('unconfigured')
        return result

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the node's work in whatever state it is."""
        result = self._run('shut down', self.close, may_refuse=False)
        self.destroy_entities()
        self._enter('finalized')
        return result

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to ``unconfigured`` after an error."""
        failure = self.failure
        self._run('clean up', self.close, may_refuse=False)
        self.failure = failure
        self.destroy_entities()
        self._enter('unconfigured')
        return TransitionCallbackReturn.SUCCESS

    def _enter(self, label: str) -> None:
        self.state_label = label
        self.state_changed()

    def _run(self, verb: str, hook: Callable[[], None], *,
             may_refuse: bool = True) -> TransitionCallbackReturn:
        """Run a hook and translate what it raises."""
        try:
            hook()
        except DmpCpgError as error:
            self.failure = error
            self.get_logger().error(f'cannot {verb}: {error}')
            refused, failed = TransitionCallbackReturn.FAILURE, TransitionCallbackReturn.ERROR
            return refused if may_refuse else failed
        except Exception as error:  # noqa: BLE001 - a hook may raise anything; nothing is lost
            self.failure = error
            self.get_logger().error(f'cannot {verb}: {traceback.format_exc()}')
            return TransitionCallbackReturn.ERROR
        self.failure = None
        return TransitionCallbackReturn.SUCCESS
