"""All ports of a proxy, and what passes through them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Final

from tickrig.host.rtc.ports.port import AnyPort
from tickrig.host.rtc_lite.relay import InRelay, OutRelay
from tickrig.host.text.log import log_of
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.messages import PortData, PortProfile

_LOG: Final = log_of(__name__)


class Relays:
    """The ports of a proxy, made from the profile of its device.

    A value that does not fit the device, and data that fit no port, are logged
    and dropped: they are no reason to stop.

    Args:
        ins: the in-ports of the device.
        outs: its out-ports.

    Attributes:
        dropped: how many values were dropped.

    Raises:
        DeviceRefused: a port of a type that nobody knows.
    """

    def __init__(self, ins: Iterable[PortProfile] = (), outs: Iterable[PortProfile] = ()) -> None:
        self._ins = [InRelay.of(profile) for profile in ins]
        self._outs = {profile.name: OutRelay.of(profile) for profile in outs}
        self.dropped = 0

    @property
    def ports(self) -> Iterator[AnyPort]:
        """The InPorts, then the OutPorts."""
        return chain((relay.port for relay in self._ins), (r.port for r in self._outs.values()))

    def fresh(self) -> Iterator[PortData]:
        """Take one new value from each InPort that has one."""
        for relay in self._ins:
            try:
                data = relay.take()
            except FieldError as error:
                self._drop(relay.port.full_name, error)
            else:
                if data is not None:
                    yield data

    def give(self, at_us: int, data: PortData) -> None:
        """Write to an OutPort what arrived from the device."""
        if (relay := self._outs.get(data.name)) is None:
            self._drop("an out-port that was not described", repr(data.name))
            return
        try:
            relay.give(data.data, at_us)
        except FieldError as error:
            self._drop(relay.port.full_name, error)

    def _drop(self, where: str, why: FieldError | str) -> None:
        self.dropped += 1
        _LOG.warning("dropped at %s: %s", where, why)
