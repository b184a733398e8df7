"""Which analogue inputs were an event: 6422h, a bit a channel (CiA 401)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds401.families import INTERRUPT_SOURCE, elements

BANK_CHANNELS: Final = 32


class InterruptSource:
    """Banks of 32 channels; reading a bank over the bus clears it.

    Attributes:
        entries: the banks.
    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._banks = dict(elements(dictionary, INTERRUPT_SOURCE))
        self.entries = list(self._banks.values())
        for entry in self.entries:
            entry.source = _read

    def note(self, number: int) -> None:
        """Set the bit of a channel, 1..254."""
        bank, bit = divmod(number - 1, BANK_CHANNELS)
        entry = self._banks.get(bank + 1)
        if entry is not None and bit < 8 * entry.size:
            bits = int.from_bytes(entry.data, "little") | 1 << bit
            entry.assign(bits.to_bytes(entry.size, "little"))


def _read(entry: Entry) -> bytes:
    data = entry.data
    entry.assign(bytes(entry.size))
    return data
