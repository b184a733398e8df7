"""The configuration sets of a component (OMG SDO, Configuration; OpenRTM-aist 1.x, ConfigAdmin)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from tickrig.host.rtc.parameter import Parameter, V
from tickrig.host.rtc.states import RtcRefused

DEFAULT: Final = "default"


class Configuration:
    """Sets of parameter values, one of them active.

    A change is checked at once and takes effect before the callbacks of the
    component's next period, at `initialize`, or when `update` is called.

    Attributes:
        active_id: the set whose values hold, or will at the next update.
        changed: whether an update has something to do.
        on_update: called with the ID of the active set after its values took effect.
    """

    def __init__(self) -> None:
        self.active_id, self.changed = DEFAULT, False
        self.on_update: list[Callable[[str], None]] = []
        self._parameters: dict[str, Parameter[Any]] = {}
        self._sets: dict[str, dict[str, str]] = {DEFAULT: {}}

    @property
    def parameters(self) -> Mapping[str, Parameter[Any]]:
        """The parameters by name."""
        return MappingProxyType(self._parameters)

    @property
    def sets(self) -> Mapping[str, Mapping[str, str]]:
        """The values of each set as text, by its ID."""
        return MappingProxyType(self._sets)

    def bind(
        self, name: str, default: V, constraint: str = "", *, unit: str = "", widget: str = ""
    ) -> Parameter[V]:
        """Add a parameter, with its default in the set `default`.

        Args:
            name: in the configuration sets.
            default: bool, int, float, str or a tuple of one of these; the type of the values.
            constraint: what values it may have, as `0<=x<=10` (`Constraint`).
            unit: of the value, for people.
            widget: how an editor shows it, such as `text` or `slider.10`.

        Returns:
            The parameter; its `value` is what holds.

        Raises:
            ValueError: a default that the constraint does not allow, or no constraint.
        """
        parameter = Parameter(name, default, constraint, unit=unit, widget=widget)
        self._parameters[name] = parameter
        self._sets[DEFAULT][name] = parameter.text
        return parameter

    def set(self, name: str, text: str, set_id: str = "") -> None:
        """Change a value in a set, the active one if none is named.

        Raises:
            RtcRefused: no such set or parameter, or a value it may not have.
        """
        values = self._set(set_id or self.active_id)
        self._check(name, text)
        values[name] = text
        self.changed = True

    def add_set(self, set_id: str, values: Mapping[str, str]) -> None:
        """Add a set, or replace one; parameters left out keep their default in it.

        Raises:
            RtcRefused: no such parameter, or a value it may not have.
        """
        for name, text in values.items():
            self._check(name, text)
        self._sets[set_id] = dict(values)
        self.changed = True

    def remove_set(self, set_id: str) -> None:
        """Remove a set; RtcRefused for one that is not there, the default and the active one."""
        self._set(set_id)
        if set_id in (DEFAULT, self.active_id):
            raise RtcRefused(f"configuration set {set_id!r} is in use")
        del self._sets[set_id]

    def activate(self, set_id: str) -> None:
        """Let the values of a set hold from the next update on; RtcRefused if it is not there."""
        self._set(set_id)
        self.active_id, self.changed = set_id, True

    def update(self) -> None:
        """Let the values of the active set take effect."""
        self.changed = False
        values = self._sets[self.active_id]
        for name, parameter in self._parameters.items():
            text = values.get(name)
            parameter.value = parameter.default if text is None else parameter.parse(text)
        for listener in tuple(self.on_update):
            listener(self.active_id)

    def _set(self, set_id: str) -> dict[str, str]:
        if (values := self._sets.get(set_id)) is None:
            known = ", ".join(self._sets)
            raise RtcRefused(f"no configuration set {set_id!r}; known: {known}")
        return values

    def _check(self, name: str, text: str) -> None:
        if (parameter := self._parameters.get(name)) is None:
            known = ", ".join(self._parameters) or "none"
            raise RtcRefused(f"no parameter {name!r}; known: {known}")
        parameter.parse(text)
