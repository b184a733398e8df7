"""The objects of one node with the latest values that were heard."""

from __future__ import annotations

from typing import Final, NamedTuple

from tickrig.host.monitor.decode.decoded import Decoded
from tickrig.host.monitor.decode.objects.memory import Entry, NodeMemory
from tickrig.host.monitor.decode.sdo.transfer import Outcome, Transfer, write_entry
from tickrig.host.monitor.dictionary.object_row import ObjectRow, Origin
from tickrig.wire.canopen.pdo import MAX_MAPPED_OBJECTS, MappedObject
from tickrig.wire.canopen.sdo.abort import describe_abort

FIRST_OBJECT: Final = 0x1000
"""Below it are data types (CiA 301, structure of the object dictionary)."""

MAPPINGS: Final = {"tpdo": 0x1A00, "rpdo": 0x1600}


class _Seen(NamedTuple):
    """A value, and how it came."""

    at_us: int
    value: str
    origin: Origin


class NodeDictionary:
    """Keeps what was heard of the objects of one node.

    Args:
        memory: what is known of them by the EDS and by SDO traffic.
    """

    def __init__(self, memory: NodeMemory) -> None:
        self.memory = memory
        self._values: dict[Entry, _Seen] = {}
        self._troubles: dict[Entry, str] = {}
        self._pdos: dict[str, tuple[int, Decoded]] = {}

    def take(self, at_us: int, decoded: Decoded) -> None:
        """Take a decoded frame of this node."""
        for transfer in decoded.transfers:
            self._transfer(at_us, transfer)
        if decoded.kind[:4] in MAPPINGS:
            self._pdos[decoded.kind] = at_us, decoded

    def rows(self, wanted: str = "") -> list[ObjectRow]:
        """Return the objects that are meant, by index; all for an empty text."""
        seen = self._latest()
        entries = sorted({*self.memory.eds.texts, *seen, *self._troubles})
        objects = (entry for entry in entries if entry[0] >= FIRST_OBJECT)
        rows = (self._row(entry, seen.get(entry)) for entry in objects)
        return [row for row in rows if row.is_meant(wanted)]

    def _transfer(self, at_us: int, transfer: Transfer) -> None:
        entry = transfer.entry
        if entry is None:
            return
        if transfer.outcome is Outcome.DONE:
            self._troubles.pop(entry, None)
            value = f"{transfer.text}{transfer.unit}"
            self._values[entry] = _Seen(at_us, value, Origin.SDO)
        elif transfer.outcome is Outcome.ABORTED:
            self._troubles[entry] = describe_abort(transfer.abort_code)
        else:
            self._troubles[entry] = transfer.outcome

    def _latest(self) -> dict[Entry, _Seen]:
        """Return the latest values, those of PDOs among them."""
        seen = dict(self._values)
        for kind, (at_us, decoded) in self._pdos.items():
            mapped = self._mapped(kind)
            for signal in decoded.signals:
                entry = mapped.get(signal.name)
                if entry is not None and (entry not in seen or seen[entry].at_us <= at_us):
                    value = f"{signal.text or str(signal.value)}{signal.unit}"
                    seen[entry] = _Seen(at_us, value, Origin.PDO)
        return seen

    def _mapped(self, kind: str) -> dict[str, Entry]:
        """Return what is mapped to a PDO, by the names that the decoder gives."""
        index = MAPPINGS[kind[:4]] + int(kind[4:]) - 1
        count = min(self.memory.number(index, 0) or 0, MAX_MAPPED_OBJECTS)
        found = (
            MappedObject.parse(self.memory.number(index, sub + 1) or 0) for sub in range(count)
        )
        entries = ((one.index, one.sub) for one in found)
        return {self.memory.describe(*one).name or write_entry(one): one for one in entries}

    def _row(self, entry: Entry, seen: _Seen | None) -> ObjectRow:
        text, trouble = self.memory.describe(*entry), self._troubles.get(entry, "")
        if seen is not None:
            return ObjectRow(entry, text, seen.value, seen.origin, seen.at_us, trouble)
        power_on = self.memory.eds.values.get(entry)
        if power_on is None:
            return ObjectRow(entry, text, trouble=trouble)
        value = f"{text.read(power_on)[1]}{text.unit}"
        return ObjectRow(entry, text, value, Origin.EDS, trouble=trouble)
