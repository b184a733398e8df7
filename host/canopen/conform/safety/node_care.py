"""Brings the node into the state in which checks begin, gets it back, and leaves it as it was."""

from __future__ import annotations

from collections.abc import Iterable, Set
from contextlib import suppress
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.periods import MS_US
from tickrig.host.canopen.conform.bus.sdo_client import SdoClient
from tickrig.host.canopen.conform.bus.step_failed import NotAllowed, StepFailed
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.notation.bound_check import BoundCheck
from tickrig.host.canopen.conform.notation.names import Address
from tickrig.host.canopen.conform.safety.known_state import KnownState
from tickrig.host.canopen.conform.safety.write_order import Write
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoMisnamed, SdoTimeout
from tickrig.wire.can import data_frame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand, NmtState

SETTLE_MS: Final = 20
"""So long after an NMT command a node is in its new state."""

CARE_US: Final = 60_000_000
"""So long may it take to write everything back."""

RETURN_MS: Final = 3_000
"""So long may a node take to come back after a reset."""

GONE_MS: Final = 10_000
"""So long is waited at the end for a node that was lost, to restore it."""

TRIES: Final = 2
PROBE_MS: Final = 50
HEARTBEAT: Final = (0x1017, 0)
ERROR_REGISTER: Final = (0x1001, 0)
HISTORY: Final = (0x1003, 0)
DEVICE_TYPE: Final = (0x1000, 0)
STORAGE: Final = frozenset((0x1010, 0x1011))
STORE: Final = (0x1010, 1)
SAVE: Final = b"save"

RECOVERY: Final[dict[Level, tuple[NmtCommand | None, ...]]] = {
    Level.READ_ONLY: (None,),
    Level.COMMUNICATION: (NmtCommand.RESET_COMMUNICATION,),
    Level.INTRUSIVE: (NmtCommand.RESET_COMMUNICATION, NmtCommand.RESET_NODE),
}
"""What is tried to get a node back that does not answer."""

TO_STATE: Final = {
    NmtState.OPERATIONAL: NmtCommand.START,
    NmtState.STOPPED: NmtCommand.STOP,
}


class NodeCare:
    """Cares for one node during a run.

    Args:
        exchange: the bus.
        client: reads and writes the node.
        node_id: of the node, 1..127.
        level: of the run; at READ_ONLY nothing is done but reading.

    Attributes:
        lost: the node does not answer any more.
    """

    def __init__(self, exchange: Exchange, client: SdoClient, node_id: int, level: Level) -> None:
        self._exchange, self._client, self._node_id = exchange, client, node_id
        self._level, self._state = level, KnownState(exchange, client)
        self._nmt_state: NmtState | None = None
        self._moved = False  # to another NMT state than it was in
        self._errors = 0
        self._stored = self.lost = False

    @property
    def unrestored(self) -> tuple[str, ...]:
        """What could not be written back, one a line."""
        return tuple(self._state.unrestored)

    def prepare(self, addresses: Iterable[Address]) -> None:
        """Learn how the node is, and bring it into the state in which checks begin.

        Args:
            addresses: of the objects that may change in the run.
        """
        if self._level is Level.READ_ONLY:
            return
        self._exchange.begin(CARE_US)
        self._state.learn(addresses)
        self._nmt_state = self._learn_state()
        self._moved = True
        self._command(NmtCommand.ENTER_PRE_OPERATIONAL)
        self._state.prepare()
        self._errors = self._client.number(*ERROR_REGISTER) or 0

    def begin(self, bound: BoundCheck) -> None:
        """Learn what a check may change, if that is not known yet; `lost` if it cannot be."""
        if self._level is Level.READ_ONLY:
            return
        self._exchange.begin(CARE_US)
        self._stored = self._stored or bool(STORAGE & {index for index, _ in bound.changed})
        try:
            self._state.learn(bound.written)
            self._state.write(bound.written)
            if bound.resets:
                self._state.reset()
        except (SdoFailed, StepFailed):
            self._recover()

    def unread(self, addresses: Set[Address]) -> list[Address]:
        """Return which of these could not be read, so that they cannot be written back."""
        self._exchange.begin(CARE_US)
        known = self._state.original
        try:
            self._state.learn(at for at in addresses if at[0] not in STORAGE)
        except (SdoFailed, StepFailed):
            return []  # the node is gone, which `begin` will find
        return sorted(at for at in addresses - known.keys() if at[0] not in STORAGE)

    @property
    def repairs(self) -> tuple[Write, ...]:
        """What to write to restore what could not be, in this order."""
        return tuple(self._state.repairs)

    @property
    def errors(self) -> int:
        """The bits of the error register that were set before the run, and are still."""
        return self._errors

    def is_quieted(self, at: Address) -> bool:
        """Return whether the tester has written another value than was there, to begin checks."""
        return self._state.is_quieted(at)

    def held(self, at: Address) -> bytes:
        """Return what an object held before the run; nothing if that is not known."""
        return self._state.original.get(at, b"")

    def give_up(self) -> None:
        """Tell what is not as it was: nobody can write it back."""
        self._state.give_up()

    def tidy(self, bound: BoundCheck, boots_before: int) -> bool:
        """Bring the node back after a check; False, and it is lost, if it cannot be."""
        changed = bound.resets or self._exchange.boots != boots_before
        self._exchange.begin(CARE_US)
        try:
            self._tidy(None if changed else bound.written)
        except (SdoFailed, StepFailed):
            self._recover()
        return not self.lost

    def restore(self) -> None:
        """Leave the node as it was before the run, as far as can be."""
        if self._level is Level.READ_ONLY:
            return
        self._exchange.begin(CARE_US)
        if not self._put_back() and not (self._answers(GONE_MS) and self._put_back()):
            self._state.give_up()

    def _put_back(self) -> bool:
        """Write everything back; False if the node does not answer."""
        try:
            self._client.abort()
            if self._moved:
                self._command(NmtCommand.ENTER_PRE_OPERATIONAL)
            self._state.restore()
            if self._stored:
                self._store()
            if self._nmt_state in TO_STATE:
                self._command(TO_STATE[self._nmt_state])
        except (SdoFailed, StepFailed):
            return False
        return True

    def _store(self) -> None:
        """Store what was there before, in place of what a check has stored."""
        try:
            self._client.download(*STORE, SAVE)
        except (SdoAborted, SdoMisnamed) as error:
            self._state.unrestored[f"what a check stored is still stored: {error}"] = None

    def _tidy(self, addresses: Iterable[Address] | None) -> None:
        self._client.abort()
        if self._level is Level.READ_ONLY:
            self._exchange.wait(SETTLE_MS)
            self._probe()
            return
        self._command(NmtCommand.ENTER_PRE_OPERATIONAL)
        self._state.tidy(addresses)
        if self._has_errors():
            self._command(NmtCommand.RESET_COMMUNICATION)
            self._answers(RETURN_MS)
            self._state.tidy(None)

    def _has_errors(self) -> bool:
        """Say whether a check left an error behind: those of before the run may have gone."""
        number = self._client.number(*ERROR_REGISTER)
        if number is None:
            self._probe()  # absent, or is the node gone?
            return False
        new = number & ~self._errors
        self._errors &= number
        return bool(new)

    def _probe(self) -> None:
        """Raise SdoTimeout if the node is gone; one without 1000h is there."""
        with suppress(SdoAborted, SdoMisnamed):
            self._client.upload(*DEVICE_TYPE)

    def _recover(self) -> None:
        """Try to get a node back that does not answer."""
        for command in RECOVERY[self._level]:
            self._exchange.begin(CARE_US)
            if command is not None:
                self._command(command)
            if self._answers(RETURN_MS):
                try:
                    self._tidy(None)
                except (SdoFailed, StepFailed):
                    continue
                return
        self.lost = True

    def _answers(self, within_ms: int) -> bool:
        """Wait until the node answers to SDO again."""
        until_us = self._exchange.now_us + within_ms * MS_US
        while True:
            try:
                self._client.upload(*DEVICE_TYPE)
            except (SdoAborted, SdoMisnamed):
                return True
            except SdoTimeout:
                if self._exchange.now_us >= until_us:
                    return False
                self._exchange.wait(PROBE_MS)
            else:
                return True

    def _learn_state(self) -> NmtState | None:
        """Learn the NMT state from a heartbeat, which is switched on for the purpose."""
        if HEARTBEAT not in self._state.original:  # it could not be written back
            return None
        self._state.write({HEARTBEAT})
        try:
            self._client.download(*HEARTBEAT, PROBE_MS.to_bytes(2, "little"))
            pattern = f"{ERROR_CONTROL_COB_ID + self._node_id:03X}#.."
            text = self._exchange.expect([pattern], 3 * PROBE_MS)
            return NmtState(int(text[-2:], 16) & 0x7F)
        except (SdoFailed, StepFailed, NotAllowed, ValueError):
            return None

    def _command(self, command: NmtCommand) -> None:
        try:
            self._exchange.send(data_frame(NMT_COB_ID, bytes((command, self._node_id))))
        except NotAllowed:
            return
        self._exchange.wait(SETTLE_MS)
