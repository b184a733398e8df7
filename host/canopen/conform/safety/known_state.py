"""The state in which each check begins, and the one in which the node is left."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.sdo_client import SdoClient
from tickrig.host.canopen.conform.bus.step_failed import NotAllowed
from tickrig.host.canopen.conform.notation.names import Address
from tickrig.host.canopen.conform.safety.write_order import Values, in_order
from tickrig.host.canopen.errors import SdoAborted
from tickrig.wire.canopen.cob_id import FLAG_30

SYNC_COB_ID: Final = (0x1005, 0)
QUIET: Final = (
    (0x1006, 0),
    (0x100C, 0),
    (0x100D, 0),
    (0x1015, 0),
    (0x1017, 0),
    (0x1019, 0),
    (0x1029, 1),
)
"""Objects that are 0 when a check begins: no SYNC, guarding or heartbeat by itself."""
CONSUMERS: Final = 0x1016
TEXTS: Final = range(0x1008, 0x100B)
NUMBERS: Final = range(9)
"""So many bytes are a number, not a text."""


class KnownState:
    """Values of the node before the run, and in the state in which checks begin.

    Args:
        exchange: the bus.
        client: reads and writes the node.

    Attributes:
        original: what objects held before the run.
        changed: what the check under way may have changed.
        written: what checks wrote, or tried to, in this run.
        unrestored: what could not be written back, one a line.
    """

    def __init__(self, exchange: Exchange, client: SdoClient) -> None:
        self._exchange, self._client = exchange, client
        self.original: Values = {}
        self._begin: Values = {}
        self.changed: frozenset[Address] = frozenset()
        self.written: set[Address] = set()
        self.unrestored: dict[str, None] = {}

    def learn(self, addresses: Iterable[Address]) -> None:
        """Read objects that are not known yet; what cannot be read is not restored."""
        for at in addresses:
            if at not in self.original:
                value = self._read(at)
                if value is not None:
                    self.original[at] = self._begin[at] = value

    def prepare(self) -> None:
        """Bring what is known into the state in which checks begin."""
        for at, value in self.original.items():
            if at in QUIET or (at[0] == CONSUMERS and at[1]):
                self._begin[at] = bytes(len(value))
            elif at == SYNC_COB_ID:
                number = int.from_bytes(value, "little") & ~FLAG_30
                self._begin[at] = number.to_bytes(len(value), "little")
        left = self._write_back(self._begin, self._begin)
        for at in left:
            self._begin[at] = self.original[at]

    def tidy(self, addresses: Iterable[Address] | None) -> None:
        """Bring objects into the state in which checks begin; all that are known if None."""
        touched = self._begin if addresses is None else addresses
        self._write_back(self._begin, [at for at in touched if at in self._begin])
        self.changed = frozenset()

    def restore(self) -> None:
        """Bring all objects into the state before the run, and tell what could not be."""
        for at in self._write_back(self.original, self.original):
            self.unrestored[self._was(at)] = None

    def give_up(self) -> None:
        """Tell what was written and may not be as it was: the node is gone."""
        for at, value in self.original.items():
            if at in self.written and (self._begin[at] != value or at in self.changed):
                self.unrestored[f"{self._was(at)}; not verified: the node was lost"] = None

    def _was(self, at: Address) -> str:
        value = self.original[at]
        text = value.decode("latin-1")
        is_text = at[0] in TEXTS or (len(value) not in NUMBERS and text.isprintable())
        return f"{at[0]:04X}h:{at[1]:02X} was {repr(text) if is_text else value.hex().upper()}"

    def _write_back(self, target: Values, addresses: Iterable[Address]) -> list[Address]:
        """Write what differs; return what differs still."""
        wrong = self._differing(target, addresses)
        if not wrong:
            return []
        for at, value in in_order({at: target[at] for at in wrong}, self._number):
            self.written.add(at)
            try:
                self._client.download(*at, value)
            except (SdoAborted, NotAllowed):
                continue  # told below, if it differs still
        return self._differing(target, wrong)

    def _differing(self, target: Values, addresses: Iterable[Address]) -> list[Address]:
        return [at for at in addresses if self._read(at) != target[at]]

    def _number(self, at: Address) -> int:
        return int.from_bytes(self._read(at) or b"", "little")

    def _read(self, at: Address) -> bytes | None:
        try:
            return self._client.upload(*at)
        except SdoAborted:
            return None
