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
        self._outbox.add(now_us, command)
        self.mirror.sent(command)

    def take(self, reply: Answer, exchange: Exchange | None) -> bool:
        """Account for a reply; False if no command awaits it."""
        match reply:
            case Refusal(reason):
                counts = exchange is None or not exchange.refuses_barrier_too(reason)
                name = self._refused_name(reply, exchange)
                if counts:
                    self.refusals.refused(name, reason)
                return True
            case Ok(name) if self._take_unawaited(name, exchange):
                return True
            case Ok() | Text():
                return exchange is not None and self._take_answer(reply, exchange)

    def settle(self, now_us: int) -> None:
        """With stablemode, take commands as carried out that no ER came for."""
        for name in self._outbox.settle(now_us):
            if self.mirror.stable:
                self.refusals.accepted(name)

    @property
    def doubt_ends_us(self) -> int:
        """Until when an OK may belong to a command from before `wiped`; 0 if none may."""
        return self._outbox.doubt_ends_us

    def wiped(self) -> None:
        """The RRC was initialized: nothing that was known holds any more.

        But a command that waited in its receive buffer meanwhile is carried out after that.
        """
        self.mirror.wiped()
        self.refusals.clear()
        self._outbox.doubt()

    def clear(self) -> None:
        """Forget all: the talk begins again."""
        self.wiped()
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
        if (name := self._outbox.refused(refusal.reason)) is not None:
            return name
        return exchange.name if exchange is not None and exchange.take(refusal) else ""

    def _take_unawaited(self, name: str, exchange: Exchange | None) -> bool:
        """Account for an OK to a command that nobody waits for; False if it is not one."""
        in_doubt = self._outbox.doubt_ends_us > 0
        command = self._outbox.carried_out(name)
        if command is None:
            return False
        awaited_too = in_doubt and exchange is not None and exchange.name == name
        self.refusals.accepted(name)
        self.mirror.sent(exchange.command if exchange and awaited_too else command)
        return True

    def _take_answer(self, answer: Ok | Text, exchange: Exchange) -> bool:
        was_done = exchange.done
        taken = exchange.take(answer)
        if exchange.done and not was_done and exchange.refusal is None:
            self.refusals.accepted(exchange.name)
            self.mirror.accepted(exchange.command)
        return taken
