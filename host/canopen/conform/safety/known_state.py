"""The state in which each check begins, and the one in which the node is left."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from functools import partial
from typing import Final, TypeVar

from tickrig.host.canopen.conform.binding.object_reader import PATIENCE
from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.sdo_client import SdoClient, number_of
from tickrig.host.canopen.conform.bus.step_failed import NotAllowed
from tickrig.host.canopen.conform.notation.names import Address
from tickrig.host.canopen.conform.safety.write_order import Values, Write, in_order, is_standard
from tickrig.host.canopen.errors import SdoAborted, SdoMisnamed, SdoTimeout
from tickrig.wire.canopen.cob_id import FLAG_30

T = TypeVar("T")

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
PDOS: Final = (*range(0x1400, 0x1600), *range(0x1800, 0x1A00))
INHIBIT_TIME, EVENT_TIMER = 3, 5
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
        written: what may have changed, and has not been seen to be as before since.
        all_written: what was written in this run.
        unrestored: what could not be written back, one a line.
        repairs: what to write to restore the rest, in this order.
    """

    def __init__(self, exchange: Exchange, client: SdoClient) -> None:
        self._exchange, self._client = exchange, client
        self.original: Values = {}
        self._begin: Values = {}
        self.written: set[Address] = set()
        self.all_written: set[Address] = set()
        self.unrestored: dict[str, None] = {}
        self.repairs: list[Write] = []
        self._silent = 0

    def learn(self, addresses: Iterable[Address]) -> None:
        """Read objects that are not known yet; what cannot be read is not restored."""
        for at in addresses:
            if at not in self.original and (value := self._read(at)) is not None:
                self.original[at] = self._begin[at] = value

    def prepare(self) -> None:
        """Bring what is known into the state in which checks begin."""
        for at, value in self.original.items():
            if at in QUIET or (at[0] == CONSUMERS and at[1]) or _is_timer(at):
                self._begin[at] = bytes(len(value))
            elif at == SYNC_COB_ID:
                number = int.from_bytes(value, "little") & ~FLAG_30
                self._begin[at] = number.to_bytes(len(value), "little")
        left = self._write_back(self._begin, self._begin)
        for at in left:
            self._begin[at] = self.original[at]

    def is_quieted(self, at: Address) -> bool:
        """Return whether checks begin with another value than was there before the run."""
        return self._begin.get(at) != self.original.get(at)

    def write(self, addresses: Collection[Address]) -> None:
        """Take note of what may change."""
        self.written.update(addresses)
        self.all_written.update(addresses)

    def reset(self) -> None:
        """Take note that all that was written may have other values."""
        self.written |= self.all_written

    def tidy(self, addresses: Iterable[Address] | None) -> None:
        """Bring objects into the state in which checks begin; all that are known if None."""
        touched = self._begin if addresses is None else addresses
        self._write_back(self._begin, [at for at in touched if at in self._begin])

    def restore(self) -> None:
        """Bring all objects into the state before the run, and tell what could not be."""
        left = self._write_back(self.original, self.original)
        for at in left:
            self.unrestored[self._was(at)] = None
        self._repair(left)

    def give_up(self) -> None:
        """Tell what was written and may not be as it was: the node is gone."""
        left = [at for at in self.original if at in self.written]
        for at in left:
            self.unrestored[f"{self._was(at)}; not verified: the node was lost"] = None
        self._repair(left)

    def _repair(self, addresses: Iterable[Address]) -> None:
        """Take note of what a person has to write to restore what is left."""

        def number(at: Address) -> int | None:
            value = self.original.get(at, b"")
            return number_of(value) if is_standard(at, value) else None

        self.repairs += in_order({at: self.original[at] for at in addresses}, number)

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
        touched = dict.fromkeys(wrong)
        writes = in_order({at: target[at] for at in wrong}, lambda at: self._number(at, target))
        for at, value in writes:
            touched[at] = None
            self.write({at})
            with suppress(SdoAborted, NotAllowed):  # it is reported if it differs still
                self._patiently(partial(self._client.download, *at, value))
        return self._differing(target, [at for at in touched if at in target])

    def _differing(self, target: Values, addresses: Iterable[Address]) -> list[Address]:
        return [at for at in addresses if not self._holds(at, target[at])]

    def _holds(self, at: Address, wanted: bytes) -> bool:
        held = self._read(at)
        if held is not None and held == self.original.get(at):
            self.written.discard(at)
        return held == wanted

    def _number(self, at: Address, target: Values) -> int | None:
        """Return what an object holds, or should hold if the node does not tell it well.

        None if it is not known what it should hold: then it is not touched.
        """
        if at not in target or not is_standard(at, target[at]):
            return None
        held = self._read(at)
        return number_of(held if held and is_standard(at, held) else target[at])

    def _read(self, at: Address) -> bytes | None:
        """Read an object; None if the node refuses, or gives no answer about this one."""
        with suppress(SdoAborted):
            return self._patiently(partial(self._client.upload, *at))
        return None

    def _patiently(self, attempt: Callable[[], T]) -> T | None:
        """Ask the node; None if it gives no answer about this one, SdoTimeout if it is gone."""
        try:
            answer = attempt()
        except SdoTimeout:
            self._silent += 1
            if self._silent >= PATIENCE:
                self._silent = 0
                raise
            return None
        except SdoMisnamed:
            self._silent = 0
            return None
        except SdoAborted:
            self._silent = 0
            raise
        self._silent = 0
        return answer


def _is_timer(at: Address) -> bool:
    """Return whether an object lets PDOs be sent, or held back, or missed, by themselves."""
    return at[0] in PDOS and at[1] in {INHIBIT_TIME, EVENT_TIMER}
