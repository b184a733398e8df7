"""Preparation of the node for checks, its recovery, and restoring its initial state."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Set
from contextlib import suppress
from functools import partial
from types import MappingProxyType
from typing import Final, TypeVar

from tickrig.host.canopen.conform.binding.object_reader import PATIENCE
from tickrig.host.canopen.conform.bus.exchange import MS_US, BusExchange, NotAllowed, StepFailed
from tickrig.host.canopen.conform.bus.sdo import SdoClient, number_of
from tickrig.host.canopen.conform.check import Address, Level
from tickrig.host.canopen.conform.notation import BoundCheck
from tickrig.host.canopen.conform.write_order import PDOS, Values, Write, in_order, is_standard
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoMisnamed, SdoTimeout
from tickrig.wire.can import data_frame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, FLAG_30, NMT_COB_ID, NmtCommand, NmtState

# The state in which each check begins, and the state in which the tester leaves the node.

T = TypeVar("T")

_SYNC_COB_ID: Final = (0x1005, 0)
_QUIET: Final = (
    (0x1006, 0),
    (0x100C, 0),
    (0x100D, 0),
    (0x1015, 0),
    (0x1017, 0),
    (0x1019, 0),
    (0x1029, 1),
)
"""Objects that are 0 when a check begins, so that there is no SYNC, guarding or heartbeat."""
_CONSUMERS: Final = 0x1016
INHIBIT_TIME, EVENT_TIMER = 3, 5
_TIMERS: Final = (INHIBIT_TIME, EVENT_TIMER)
"""Timers by which PDOs are sent, held back, or missed without a request of the tester."""
_TEXTS: Final = range(0x1008, 0x100B)
_NONE: Final[Mapping[Address, bytes]] = MappingProxyType({})
_NUMBERS: Final = range(9)
"""Sizes of a value that is a number. A longer value is a text."""


class KnownState:
    """Values of the node's objects: those before the run, and those with which each check begins.

    The two differ for example in timers, which are switched off for the checks.

    Args:
        exchange: bus with the node.
        client: SDO client that reads and writes the objects.

    Attributes:
        original: values before the run, by object.
        written: objects that may have changed since they were last compared.
        all_written: objects that were written at any time in this run.
        stored: objects written by checks that store parameters in the node. A reset may bring the
            stored values back.
        unrestored: texts about objects that could not be restored.
        repairs: writes that would restore these objects, in this order.
    """

    def __init__(self, exchange: BusExchange, client: SdoClient) -> None:
        self._exchange, self._client = exchange, client
        self.original: Values = {}
        self._begin: Values = {}
        self.written: set[Address] = set()
        self.all_written: set[Address] = set()
        self.stored: set[Address] = set()
        self.unrestored: dict[str, None] = {}
        self.repairs: list[Write] = []
        self._seen: Values = {}  # what was read since the last check, reset or boot-up
        self._seen_boots = 0
        self._is_reset = False
        self._moved: dict[str, set[Address]] = {}  # objects that each kind of reset changed
        self._silent = 0

    def learn(self, addresses: Iterable[Address], held: Mapping[Address, bytes] = _NONE) -> None:
        """Read the original values of objects that a run may change, so that they can be restored.

        An object that cannot be read will not be restored.

        Args:
            addresses: index and sub-index of each object.
            held: values that have just been read, by object. These objects are not read again.
        """
        for at in addresses:
            if at in self.original:
                continue
            value = held[at] if at in held else self._read(at)
            if value is not None:
                self.original[at] = self._begin[at] = self._seen[at] = value

    def prepare(self) -> None:
        """Bring the known objects into the state in which checks begin."""
        for at, value in self.original.items():
            is_timer = at[1] in _TIMERS and at[0] in PDOS
            if is_timer or at in _QUIET or (at[0] == _CONSUMERS and at[1]):
                self._begin[at] = bytes(len(value))
            elif at == _SYNC_COB_ID:
                number = int.from_bytes(value, "little") & ~FLAG_30
                self._begin[at] = number.to_bytes(len(value), "little")
        # What was learnt holds still, but where another value is wanted or a write may have changed
        # it.
        known = self.original
        changed = [at for at in known if at in self.written or self._begin[at] != known[at]]
        left = self._write_back(self._begin, changed)
        for at in left:
            self._begin[at] = self.original[at]

    def held(self, at: Address) -> bytes:
        """Return the value of an object before the run; empty if it is unknown."""
        return self.original.get(at, b"")

    def is_quieted(self, at: Address) -> bool:
        """Return whether an object has another value during checks than before the run."""
        return self._begin.get(at) != self.original.get(at)

    def write(self, addresses: Collection[Address]) -> None:
        """Record objects that may change."""
        self.written.update(addresses)
        self.all_written.update(addresses)
        for at in addresses:
            self._seen.pop(at, None)

    def forget(self) -> None:
        """Read all objects again, because any object may have changed."""
        self._seen.clear()

    def reset(self) -> None:
        """Record that all written objects may have other values, until `tidy_after`."""
        self._is_reset = True

    def tidy(self, addresses: Iterable[Address]) -> None:
        """Bring objects into the state in which checks begin."""
        self._write_back(self._begin, [at for at in addresses if at in self._begin])

    def tidy_after(self, resets: Collection[str] = (), written: Collection[Address] = ()) -> None:
        """After a reset, give the changed objects the values with which each check begins.

        There are several kinds of resets, such as NMT reset communication. After the first reset of
        a kind, the tester reads all objects, and records the objects that this kind of reset
        changes. After later resets of the same kind, the tester reads only the recorded objects and
        the objects written since the last reset.

        Args:
            resets: kinds of the resets that happened, empty if the kind is unknown.
            written: objects that may have been written since the last reset.
        """
        touched: Iterable[Address] = self._begin
        if resets and self._moved.keys() >= set(resets):
            known = self.stored.union(
                written, self.written, *(self._moved[kind] for kind in resets)
            )
            touched = [at for at in self._begin if at in known or self.is_quieted(at)]
        moved = [self._moved.setdefault(kind, set()) for kind in resets]
        self._write_back(self._begin, touched, moved)
        self._is_reset = False

    def restore(self) -> None:
        """Restore all objects to their values before the run. Report the objects that failed."""
        left = self._write_back(self.original, self.original)
        for at in left:
            self.unrestored[self._was(at)] = None
        self._repair(left)

    def give_up(self) -> None:
        """Report the written objects that may have other values, because the node is gone."""
        unsure = self.all_written if self._is_reset else self.written
        left = [at for at in self.original if at in unsure]
        for at in left:
            self.unrestored[f"{self._was(at)}; not verified: the node was lost"] = None
        self._repair(left)

    def _repair(self, addresses: Iterable[Address]) -> None:
        """Record what a person has to write to restore the remaining objects."""

        def number(at: Address) -> int | None:
            value = self.original.get(at, b"")
            return number_of(value) if is_standard(at, value) else None

        self.repairs += in_order({at: self.original[at] for at in addresses}, number)

    def _was(self, at: Address) -> str:
        value = self.original[at]
        text = value.decode("latin-1")
        is_text = at[0] in _TEXTS or (len(value) not in _NUMBERS and text.isprintable())
        return f"{at[0]:04X}h:{at[1]:02X} was {repr(text) if is_text else value.hex().upper()}"

    def _write_back(
        self, target: Values, addresses: Iterable[Address], moved: Iterable[set[Address]] = ()
    ) -> list[Address]:
        """Write the values that differ, and add them to sets.

        Return the values that still differ.
        """
        wrong = self._differing(target, addresses)
        for each in moved:
            each.update(wrong)
        if not wrong:
            return []
        touched = dict.fromkeys(wrong)
        writes = in_order({at: target[at] for at in wrong}, lambda at: self._number(at, target))
        for at, value in writes:
            touched[at] = None
            self.write({at})
            with suppress(SdoAborted, NotAllowed):  # it is reported if it still differs
                self._patiently(partial(self._client.download, *at, value))
        for at in touched:  # one that could not be written may have changed with the others
            self._seen.pop(at, None)
        return self._differing(target, [at for at in touched if at in target])

    def _differing(self, target: Values, addresses: Iterable[Address]) -> list[Address]:
        left = []
        for at in addresses:
            held = self._read(at)
            if held is not None and held == self.original.get(at):
                self.written.discard(at)
            if held != target[at]:
                left.append(at)
        return left

    def _number(self, at: Address, target: Values) -> int | None:
        """Return the value of an object, or the wanted value if the object cannot be read.

        The result is None if neither value is known. The object is then not changed.
        """
        if at not in target or not is_standard(at, target[at]):
            return None
        held = self._read(at)
        return number_of(held if held and is_standard(at, held) else target[at])

    def _read(self, at: Address) -> bytes | None:
        """Return the value of an object, or None if the node refuses to read it or does not answer.

        Objects that were read since the last check are not read again. Two full checks of the
        dictionary in a row took a fifth of the frames of a short run.
        """
        if self._exchange.boots != self._seen_boots:
            self._seen_boots = self._exchange.boots
            self._seen.clear()
        if at in self._seen:
            return self._seen[at]
        try:
            value = self._patiently(partial(self._client.upload, *at))
        except SdoAborted:
            return None
        if value is not None:
            self._seen[at] = value
        return value

    def _patiently(self, attempt: Callable[[], T]) -> T | None:
        """Read an object.

        The result is None if only this object has no answer. Raise SdoTimeout if the node is gone.
        """
        try:
            answer = attempt()
        except SdoTimeout:
            self._silent += 1
            if self._silent < PATIENCE:
                return None
            self._silent = 0
            raise
        except SdoMisnamed:
            answer = None
        except SdoAborted:
            self._silent = 0
            raise
        self._silent = 0
        return answer


_SETTLE_MS: Final = 20
"""Time after an NMT command until a node is in its new state."""

_CARE_US: Final = 60_000_000
"""The longest time to restore everything."""

_RETURN_MS: Final = 3_000
"""The longest time that a node may take to answer after a reset."""

_GONE_MS: Final = 10_000
"""Time to wait at the end for a lost node, in order to restore it."""

_PROBE_MS: Final = 50
HEARTBEAT: Final = (0x1017, 0)
_ERROR_REGISTER: Final = (0x1001, 0)
_HISTORY: Final = (0x1003, 0)
_DEVICE_TYPE: Final = (0x1000, 0)
_STORAGE: Final = frozenset((0x1010, 0x1011))
_STORE: Final = (0x1010, 1)
_SAVE: Final = b"save"
_RESET_COMMUNICATION: Final = f"{NMT_COB_ID:03X}#{NmtCommand.RESET_COMMUNICATION:02X}"
"""A value of `BoundCheck.resets` that stands for NMT reset communication."""

_RECOVERY: Final[dict[Level, tuple[NmtCommand | None, ...]]] = {
    Level.READ_ONLY: (None,),
    Level.COMMUNICATION: (NmtCommand.RESET_COMMUNICATION,),
    Level.INTRUSIVE: (NmtCommand.RESET_COMMUNICATION, NmtCommand.RESET_NODE),
}
"""Attempts to recover a node that does not answer, in order."""

_RESETS: Final = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)
_TO_STATE: Final = {NmtState.OPERATIONAL: NmtCommand.START, NmtState.STOPPED: NmtCommand.STOP}


class NodeCare:
    """Helper that prepares the node for checks, recovers it after failures, and restores it.

    Args:
        exchange: bus with the node.
        client: SDO client that reads and writes the objects.
        node_id: node-ID of the node, 1..127.
        level: level of the run. With the level READ_ONLY, nothing is written.

    Attributes:
        state: store of two values of each object: the value before the run, and the value with
            which each check begins.
        errors: the bits of the error register that were set before the run and are still set.
        lost: whether the node no longer answers.
    """

    def __init__(
        self, exchange: BusExchange, client: SdoClient, node_id: int, level: Level
    ) -> None:
        self._exchange, self._client, self._node_id = exchange, client, node_id
        self._level, self.state = level, KnownState(exchange, client)
        self._nmt_state: NmtState | None = None
        self._moved = False  # into another NMT state than before
        self.errors = 0
        self._stored = self.lost = False

    def prepare(self, addresses: Iterable[Address], held: Mapping[Address, bytes] = _NONE) -> None:
        """Record the values of the node before the run, and prepare the node for the checks.

        The node is switched to Pre-operational. Objects that would disturb checks, such as the
        timers of PDOs, get other values. With the level READ_ONLY, nothing is done.

        Args:
            addresses: index and sub-index of each object that may change in the run.
            held: values that have just been read, by object.
        """
        if self._level is Level.READ_ONLY:
            return
        self._exchange.begin(_CARE_US)
        self.state.learn(addresses, held)
        self._nmt_state = self._learn_state()
        self._moved = True
        self._command(NmtCommand.ENTER_PRE_OPERATIONAL)
        self.state.prepare()
        self.errors = self._client.number(*_ERROR_REGISTER) or 0

    def begin(self, bound: BoundCheck) -> None:
        """Record unknown values that a check may change. Set `lost` if that fails."""
        if self._level is Level.READ_ONLY:
            return
        self._exchange.begin(_CARE_US)
        self._stored = self._stored or bool(_STORAGE & {index for index, _ in bound.changed})
        try:
            self.state.learn(bound.written)
            self.state.write(bound.written)
            if bound.resets:
                self.state.reset()
            self.state.forget()
        except (SdoFailed, StepFailed):
            self._recover()

    def unread(self, addresses: Set[Address]) -> list[Address]:
        """Return the objects that could not be read, and therefore cannot be restored."""
        self._exchange.begin(_CARE_US)
        known = self.state.original
        try:
            self.state.learn(at for at in addresses if at[0] not in _STORAGE)
        except (SdoFailed, StepFailed):
            return []  # the node is gone, which `begin` will detect
        return sorted(at for at in addresses - known.keys() if at[0] not in _STORAGE)

    def tidy(self, bound: BoundCheck, boots_before: int) -> bool:
        """Restore the node after a check. Return False if this fails, because the node is lost."""
        booted, crashed = self._exchange.boots - boots_before, bool(self._exchange.crashes)
        storing = {f"{index:04X}" for index, _ in bound.changed if index in _STORAGE}
        if storing:
            self.state.stored |= bound.written
        kinds = storing.union(bound.resets)
        if crashed or booted > len(bound.resets):
            kinds.clear()
        self._exchange.begin(_CARE_US)
        try:
            self._tidy(bound.written, kinds if bound.resets or booted else None)
        except (SdoFailed, StepFailed):
            self._recover()
        return not self.lost

    def restore(self) -> None:
        """Restore the state that the node had before the run, as far as possible."""
        if self._level is Level.READ_ONLY:
            return
        self._exchange.begin(_CARE_US)
        if not self._put_back():
            self.state.forget()
            if not (self._answers(_GONE_MS) and self._put_back()):
                self.state.give_up()

    def _put_back(self) -> bool:
        """Restore all values. Return False if the node does not answer."""
        try:
            self._client.abort()
            if self._moved:
                self._command(NmtCommand.ENTER_PRE_OPERATIONAL)
            self.state.restore()
            if self._stored:
                self._store()
            if self._nmt_state in _TO_STATE:
                self._command(_TO_STATE[self._nmt_state])
        except (SdoFailed, StepFailed):
            return False
        return True

    def _store(self) -> None:
        """Store the previous values, in place of the values that a check stored."""
        try:
            self._client.download(*_STORE, _SAVE)
        except (SdoAborted, SdoMisnamed) as error:
            self.state.unrestored[f"what a check stored is still stored: {error}"] = None

    def _tidy(self, written: Collection[Address], resets: Collection[str] | None = None) -> None:
        """Recover the node. `resets` has the meaning of `KnownState.tidy_after`, or is None."""
        self._client.abort()
        if self._level is Level.READ_ONLY:
            self._exchange.wait(_SETTLE_MS)
            self._probe()
            return
        self._command(NmtCommand.ENTER_PRE_OPERATIONAL)
        if resets is None:
            self.state.tidy(written)
        else:
            self.state.tidy_after(resets, written)
        if self._has_errors():
            self._command(NmtCommand.RESET_COMMUNICATION)
            self._answers(_RETURN_MS)
            self.state.tidy_after({_RESET_COMMUNICATION}, written)

    def _has_errors(self) -> bool:
        """Return whether a check caused a new error. Earlier errors may have disappeared."""
        number = self._client.number(*_ERROR_REGISTER)
        if number is None:
            self._probe()  # is the object absent, or the node gone?
            return False
        new = number & ~self.errors
        self.errors &= number
        return bool(new)

    def _probe(self) -> None:
        """Raise SdoTimeout if the node is gone. A node without 1000h is not gone."""
        with suppress(SdoAborted, SdoMisnamed):
            self._client.upload(*_DEVICE_TYPE)

    def _recover(self) -> None:
        """Try to recover a node that does not answer."""
        for command in _RECOVERY[self._level]:
            self._exchange.begin(_CARE_US)
            if command is not None:
                self._command(command)
            if self._answers(_RETURN_MS):
                try:
                    self._tidy((), ())
                except (SdoFailed, StepFailed):
                    continue
                return
        self.lost = True

    def _answers(self, within_ms: int) -> bool:
        """Wait until the node answers to SDO again."""
        until_us = self._exchange.now_us + within_ms * MS_US
        while True:
            try:
                self._probe()
            except SdoTimeout:
                if self._exchange.now_us >= until_us:
                    return False
                self._exchange.wait(_PROBE_MS)
            else:
                return True

    def _learn_state(self) -> NmtState | None:
        """Read the NMT state from a heartbeat, which is switched on for this purpose."""
        if HEARTBEAT not in self.state.original:  # it could not be restored
            return None
        self.state.write({HEARTBEAT})
        try:
            self._client.download(*HEARTBEAT, _PROBE_MS.to_bytes(2, "little"))
            pattern = f"{ERROR_CONTROL_COB_ID + self._node_id:03X}#.."
            text = self._exchange.expect([pattern], 3 * _PROBE_MS)
            return NmtState(int(text[-2:], 16) & 0x7F)
        except (SdoFailed, StepFailed, NotAllowed, ValueError):
            return None

    def _command(self, command: NmtCommand) -> None:
        try:
            self._exchange.send(data_frame(NMT_COB_ID, bytes((command, self._node_id))))
        except NotAllowed:
            return
        if command in _RESETS:
            self.state.forget()
        self._exchange.wait(_SETTLE_MS)
