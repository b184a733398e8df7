"""Which reply answers which command, and what follows from it."""

from __future__ import annotations

from tickrig.host.rrc.exchange import Exchange
from tickrig.host.rrc.inbox import Answer
from tickrig.host.rrc.mirror import Mirror
from tickrig.host.rrc.outbox import Outbox
from tickrig.host.rrc.refusals import Refusals
from tickrig.wire.rrc.commands import Command
from tickrig.wire.rrc.replies import Ok, Refusal, Text


class Ledger:
    """Gives each reply to the command it belongs to.

    Attributes:
        mirror: settings of the RRC as far as they are known.
        refusals: refusals in a row.
    """

    def __init__(self, refusals: Refusals) -> None:
        self.mirror = Mirror()
        self.refusals = refusals
        self._outbox = Outbox()

    def sent(self, now_us: int, command: Command) -> None:
        """Note a command that nobody waits for."""
        self._outbox.add(now_us, command.name.decode())
        self.mirror.sent(command)

    def take(self, reply: Answer, exchange: Exchange | None) -> bool:
        """Account for a reply; False if no command awaits it."""
        match reply:
            case Refusal(reason):
                self.refusals.refused(self._refused_name(reply, exchange), reason)
                return True
            case Ok(name) if self._outbox.claim(name) is not None:
                self.refusals.accepted(name)
                return True
            case Ok() | Text():
                return exchange is not None and self._take_answer(reply, exchange)

    def settle(self, now_us: int) -> None:
        """With stablemode, take commands as carried out that no ER came for."""
        for name in self._outbox.settle(now_us):
            if self.mirror.stable:
                self.refusals.accepted(name)

    def wiped(self) -> None:
        """The RRC was initialized: nothing that was known holds any more."""
        self.mirror.wiped()
        self.refusals.clear()
        self._outbox.clear()

    def _refused_name(self, refusal: Refusal, exchange: Exchange | None) -> str:
        """Return the name of the refused command, empty if that cannot be known.

        Commands are answered in order: the oldest one that can be meant is
        meant. But where carried out commands have no answer that cannot be
        known, and the awaited one goes first: better to report a setting as
        refused that was not than the other way round.
        """
        if exchange is not None and exchange.has_barrier and exchange.take(refusal):
            return exchange.name
        if (name := self._outbox.claim(refusal.reason)) is not None:
            return name
        return exchange.name if exchange is not None and exchange.take(refusal) else ""

    def _take_answer(self, answer: Ok | Text, exchange: Exchange) -> bool:
        was_done = exchange.done
        taken = exchange.take(answer)
        if exchange.done and not was_done and exchange.refusal is None:
            self.refusals.accepted(exchange.name)
            self.mirror.accepted(exchange.command)
        return taken
