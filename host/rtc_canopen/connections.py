"""Connectors that are wanted, made as soon as both ports are there."""

from __future__ import annotations

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.errors import RtcRefused
from tickrig.host.rtc.manager import Manager
from tickrig.host.rtc.port import ConnectorProfile
from tickrig.host.rtc_canopen.definition import RtConnection
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

    @property
    def all(self) -> tuple[RtConnection, ...]:
        """Those that are made, then those that are wanted."""
        made = (_entry(profile) for profile in self._manager.connectors)
        return (*made, *self.wanted)

    def make(self) -> None:
        """Make those whose ports are there; one that cannot be is wanted no more."""
        for entry in tuple(self.wanted):
            try:
                self._manager.port(entry.source)
                self._manager.port(entry.target)
            except RtcRefused:
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

    def _connect(self, entry: RtConnection) -> None:
        ends = f"{entry.source} to {entry.target}"
        try:
            self._manager.connect(entry.source, entry.target, entry.properties)
        except RtcRefused as error:
            self._note(EventKind.CONNECTION_REFUSED, 0, str(error))
        else:
            self._note(EventKind.CONNECTED, 0, ends)


def _entry(profile: ConnectorProfile) -> RtConnection:
    source, target = profile.ports
    return RtConnection(source, target, dict(profile.properties))
