"""Connectors that are wanted, made as soon as both ports are there."""

from __future__ import annotations

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.errors import RtcRefused
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc_canopen.definition.definition import RtConnection
from tickrig.host.rtc_canopen.events import EventKind, Note


class Connections:
    """Makes connectors, and keeps in mind those that go with a component.

    Args:
        manager: has the ports.
        wanted: connectors to be made.
        note: told what became of each.

    Attributes:
        wanted: those that have not been made.
    """

    def __init__(self, manager: Manager, wanted: tuple[RtConnection, ...], note: Note) -> None:
        self._manager, self._note = manager, note
        self.wanted = list(wanted)
        self._refused = set[str]()

    @property
    def all(self) -> tuple[RtConnection, ...]:
        """Those that are made, then those that are wanted."""
        made = (_entry(profile) for profile in self._manager.connectors)
        return (*made, *self.wanted)

    def make(self) -> None:
        """Make those whose ports are there; one that cannot be is wanted no more."""
        for entry in tuple(self.wanted):
            try:
                if not are_there(self._manager, entry):
                    continue
            except RtcRefused as error:
                self._refuse(str(error))
                continue
            self.wanted.remove(entry)
            self._connect(entry)

    def keep(self, component: RtComponent) -> None:
        """Want those of a component again that is about to go."""
        profiles = (
            connector.profile for port in component.ports.values() for connector in port.connectors
        )
        self.wanted += (_entry(profile) for profile in profiles)

    def forget(self, first: str, second: str) -> bool:
        """Want a connection no more; False if it is none that waits."""
        ends = {first, second}
        waiting = [entry for entry in self.wanted if {entry.source, entry.target} == ends]
        self.wanted = [entry for entry in self.wanted if entry not in waiting]
        return bool(waiting)

    def _refuse(self, text: str) -> None:
        """Tell once of a port that is not there; another boot of its device may bring it."""
        if text not in self._refused:
            self._refused.add(text)
            self._note(EventKind.CONNECTION_REFUSED, 0, text)

    def _connect(self, entry: RtConnection) -> None:
        ends = f"{entry.source} to {entry.target}"
        try:
            self._manager.connect(entry.source, entry.target, entry.properties)
        except RtcRefused as error:
            self._note(EventKind.CONNECTION_REFUSED, 0, str(error))
        else:
            self._note(EventKind.CONNECTED, 0, ends)


def are_there(manager: Manager, entry: RtConnection) -> bool:
    """Say whether both components are there; RtcRefused if one that is has no such port."""
    names = {component.instance_name for component in manager.components}
    ends = [end for end in (entry.source, entry.target) if end.rpartition(".")[0] in names]
    for end in ends:
        manager.port(end)
    return len(ends) == 2


def _entry(profile: ConnectorProfile) -> RtConnection:
    source, target = profile.ports
    return RtConnection(source, target, dict(profile.properties))
