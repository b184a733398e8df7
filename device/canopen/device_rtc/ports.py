"""Data ports of a DeviceRTC: a value in the dictionary, carried by a PDO."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar, Generic, TypeVar

from tickrig.device.canopen.core.entry import Entry
from tickrig.wire.rtc_canopen.port_types import CanopenPortType
from tickrig.wire.rtc_canopen.profile import CanopenPortProfile, PortDirection, PortTransport

T = TypeVar("T")


class CanopenPort(Generic[T]):
    """What both kinds of ports have.

    Args:
        name: a letter, then up to 31 letters, digits and underscores.
        port_type: type of its values; `SHORT.sequence(4)` makes a port of four.
        cob_id: CAN-ID of its PDO; None for that of the pre-defined connection set, which the
            first four of each direction have. Without one the PDO is off.
        transport: None for a PDO if the type fits into one, else SDO.
    """

    direction: ClassVar[PortDirection]

    def __init__(
        self,
        name: str,
        port_type: CanopenPortType[T],
        *,
        cob_id: int | None = None,
        transport: PortTransport | None = None,
    ) -> None:
        self.name, self.port_type = name, port_type
        self.cob_id, self.transport = cob_id, transport
        self.entries: Sequence[Entry] = ()

    def join(self, entries: Sequence[Entry], event: Callable[[Entry], None]) -> None:
        """Keep its value in these objects; `event` sends the TPDOs that carry one."""
        self.entries, self._event = entries, event

    @property
    def profile(self) -> CanopenPortProfile:
        """The port as the profile of its component has it."""
        return CanopenPortProfile(
            self.name, self.direction, self.port_type, self.cob_id, self.transport
        )

    @property
    def value(self) -> T:
        """The present value."""
        return self.port_type.decode([entry.data for entry in self.entries])


class CanopenInPort(CanopenPort[T]):
    """Where the bus writes, by RPDO or SDO, and the component reads.

    Attributes:
        is_new: whether the bus has written since it was read, also the same value.
    """

    direction: ClassVar[PortDirection] = PortDirection.IN
    is_new: bool = False

    def join(self, entries: Sequence[Entry], event: Callable[[Entry], None]) -> None:
        """Keep its value in these objects, and hear of each write."""
        super().join(entries, event)
        for entry in entries:
            entry.written = self._on_written

    def read(self) -> T:
        """Return the present value; it is not new any more."""
        self.is_new = False
        return self.value

    def _on_written(self, entry: Entry) -> None:
        self.is_new = True


class CanopenOutPort(CanopenPort[T]):
    """Where the component writes; its TPDO goes out once in a tick with a write."""

    direction: ClassVar[PortDirection] = PortDirection.OUT

    def write(self, value: T) -> None:
        """Leave a value; it is sent in Active, also if it is the same as before.

        Raises:
            ValueError: the type has no such value.
        """
        for entry, data in zip(self.entries, self.port_type.encode(value), strict=True):
            entry.assign(data)
            self._event(entry)
