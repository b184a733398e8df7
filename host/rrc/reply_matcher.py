"""Assignment of the replies of an RRC to commands, and the consequences of replies."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

from tickrig.host.rrc.inbox import NAMELESS, Answer, Exchange
from tickrig.wire.rrc.commands import Command, Limit, Output, SpeedMode, StableMode, Watchdog
from tickrig.wire.rrc.replies import Ok, Refusal, Text

# Theory of operation
# ===================
#
# Replies have no numbers. What is known: the RRC works on lines in order, OK names its
# command, ER names it unless the name could not be read (`NAMELESS`), and with stablemode
# there is no OK.
#
# Where that leaves a choice, the safe one is made, and the choices belong together:
#
# - An ER without a name goes to a motion command that nobody waits for, if there is one:
#   refusals of `output` or `limit` in a row stop the client, so one too many is counted
#   rather than one too few.
# - With stablemode the awaited command takes an ER first. It is better to report a setting
#   as refused that was not than the other way round.
# - An OK takes the oldest command of its name, but the newest of that name is believed to
#   hold: it was carried out or will be.
# - Who drives is believed only when it is certain. A first `output` after `limit` that was
#   only sent makes it None, so that the next `drive_by_host` sends speed mode 1 first
#   (client.py, `_slow_down_before`).
# - After EV:Initialized nothing is believed, but commands that waited in the receive buffer
#   may still be carried out: they stay in doubt for 100 ms, and an OK meanwhile counts for
#   the setting too.
#
# Refusals are counted for each command by itself. Who stops, and how, is in channel.py.

_SETTLED_US: Final = 100_000
"""Time after which a missing ER can no longer arrive, which is 10 periods of the RRC."""

_MOTION: Final = ("output", "limit")


class OnRefusals(Enum):
    """What the client does after too many refusals in a row (RRC manual, notes)."""

    POWER_OFF = "poweroff"  # send poweroff; renew the watchdog no more
    WATCHDOG = "watchdog"  # send nothing, so that the watchdog trips; poweroff if none is set


class _RefusalCounter:
    """A counter of successive refusals for each command.

    Each command is counted separately, so that an accepted `beep` in between does not hide that
    every `output` is refused.

    Args:
        limit: number of successive refusals that is too many.

    Attributes:
        stopped: reason of the last refusal after too many refusals, or None.

    Raises:
        ValueError: the limit is below 1.
    """

    def __init__(self, limit: int) -> None:
        if limit < 1:
            raise ValueError(f"{limit} refusals: at least 1 must be allowed to come")
        self.limit = limit
        self.stopped: str | None = None
        self._rows: Counter[str] = Counter()

    def accepted(self, name: str) -> None:
        """Record an executed command. Its count of successive refusals restarts at zero."""
        del self._rows[name]

    def refused(self, name: str, reason: str) -> None:
        """Record a refusal. If there are now too many in a row, set `stopped`."""
        self._rows[name] += 1
        if self.stopped is None and self._rows[name] >= self.limit:
            self.stopped = reason

    def clear(self) -> None:
        """Reset the counts."""
        self._rows.clear()
        self.stopped = None


@dataclass(slots=True)
class _BelievedSettings:
    """Known settings of the RRC that affect the client.

    Attributes:
        stable: whether stablemode is on. With stablemode, every line has a CHECK, and the RRC sends
            no OK.
        watchdog_10ms: time of the watchdog in units of 10 ms. 0 means that the watchdog is off.
        locked: whether the controller's speed buttons are locked.
        drive: command that chose who drives, or None if unknown.
    """

    stable: bool = False
    watchdog_10ms: int = 0
    locked: int = 0
    drive: type[Limit | Output] | None = None

    def sent(self, command: Command) -> None:
        """Record a command that was sent without waiting. It may have changed who drives."""
        if isinstance(command, Limit | Output) and self.drive is not type(command):
            self.drive = None
        else:
            self.accepted(command)

    def accepted(self, command: Command) -> None:
        """Record a command that the RRC executed."""
        match command:
            case StableMode(on):
                self.stable = bool(on)
            case Watchdog(time_10ms):
                self.watchdog_10ms = time_10ms
            case SpeedMode(_, locked):
                self.locked = locked
            case Limit() | Output():
                self.drive = type(command)

    def clear(self) -> None:
        """Reset the settings, as the RRC does in Initialize."""
        self.stable, self.watchdog_10ms, self.locked, self.drive = False, 0, 0, None


class _Sent(NamedTuple):
    at_us: int
    command: Command

    @property
    def name(self) -> str:
        return self.command.name.decode()


class _UnconfirmedCommands:
    """Commands sent without waiting. Each command is kept until its reply or its time-out.

    Replies arrive in the order of the commands, so a reply belongs to the oldest command of its
    name. An ER without a name is assigned to a motion command if one is pending, because this is
    the safe choice.
    """

    def __init__(self) -> None:
        self._sent: deque[_Sent] = deque()
        self._doubted_us = -1  # what was sent up to then may be carried out, or lost

    @property
    def doubt_ends_us(self) -> int:
        """End of the time, in us, in which the RRC may answer commands from before its restart.

        The value is 0 if no such command waits for an answer.
        """
        in_doubt = self._sent and self._sent[0].at_us <= self._doubted_us
        return self._doubted_us + _SETTLED_US if in_doubt else 0

    def doubt(self) -> None:
        """Record that the RRC was initialized. Commands in its buffer may still be executed."""
        if self._sent:
            self._doubted_us = self._sent[-1].at_us

    def add(self, now_us: int, command: Command) -> None:
        """Record a sent command."""
        self._sent.append(_Sent(now_us, command))

    def carried_out(self, name: str) -> Command | None:
        """Process an OK of the RRC to a command with this name.

        Several commands with this name may wait for an answer. The OK answers the oldest of them.
        So the oldest command is removed.

        Returns:
            The newest command with this name. The RRC executes the newest command last. So the
            values of the newest command will apply. If no command with this name waits, the result
            is None.
        """
        same = [sent for sent in self._sent if sent.name == name]
        if not same:
            return None
        self._sent.remove(same[0])
        return same[-1].command

    def refused(self, reason: str) -> str | None:
        """Remove the command that an ER refuses. Return the name of the command."""
        wanted = (*_MOTION, None) if reason in NAMELESS else (reason,)
        for name in wanted:
            for sent in self._sent:
                if name in (None, sent.name):
                    self._sent.remove(sent)
                    return sent.name
        return None

    def settle(self, now_us: int) -> list[str]:
        """Remove the commands that got no reply in time. Return their names."""
        settled = []
        while self._sent and self._sent[0].at_us + _SETTLED_US <= now_us:
            settled.append(self._sent.popleft().name)
        return settled

    def take_all(self) -> list[str]:
        """Remove all commands. Return their names."""
        names = [sent.name for sent in self._sent]
        self._sent.clear()
        return names


class ReplyMatcher:
    """Finds the command that a reply of the RRC answers, and records the settings of the RRC.

    Args:
        max_refusals: number of refusals in a row after which the client stops sending, 1 or more.

    Attributes:
        settings: settings of the RRC, as far as known from confirmed commands.
        refusals: counter of refusals in a row.
        unconfirmed: commands that were sent without waiting and have no reply yet.
    """

    def __init__(self, max_refusals: int) -> None:
        self.settings = _BelievedSettings()
        self.refusals = _RefusalCounter(max_refusals)
        self.unconfirmed = _UnconfirmedCommands()

    def sent(self, now_us: int, command: Command) -> None:
        """Record a command that was sent without waiting."""
        self.unconfirmed.add(now_us, command)
        self.settings.sent(command)

    def take(self, reply: Answer, exchange: Exchange | None) -> bool:
        """Process a reply. Return False if no command expects the reply."""
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
        """With stablemode, count commands without an ER as executed."""
        settled = self.unconfirmed.settle(now_us)
        if self.settings.stable:
            self._accept(settled)

    def _accept(self, names: Iterable[str]) -> None:
        for name in names:
            self.refusals.accepted(name)

    def initialized(self) -> None:
        """Record that the RRC was initialized (EV:Initialized) and has lost all settings.

        Earlier commands may still be in the receive buffer of the RRC, which executes them
        afterwards.
        """
        self.settings.clear()
        self.refusals.clear()
        self.unconfirmed.doubt()

    def clear(self) -> None:
        """Reset everything for a new start."""
        self.initialized()
        self.unconfirmed.take_all()

    def _refused_name(self, refusal: Refusal, exchange: Exchange | None) -> str:
        """Return the name of the refused command, empty if unknown.

        Commands are answered in order, so the oldest candidate is assumed. With stablemode,
        executed commands have no answer, and the oldest candidate may not be the refused command.
        In this case, the awaited command is assumed. It is better to report an accepted setting as
        refused than the other way round.
        """
        if exchange is not None and exchange.has_barrier and exchange.take(refusal):
            return exchange.name
        if (name := self.unconfirmed.refused(refusal.reason)) is not None:
            return name
        return exchange.name if exchange is not None and exchange.take(refusal) else ""

    def _take_unawaited(self, name: str, exchange: Exchange | None) -> bool:
        """Process an OK to a command sent without waiting. Return False for any other OK."""
        in_doubt = self.unconfirmed.doubt_ends_us > 0
        command = self.unconfirmed.carried_out(name)
        if command is None:
            return False
        awaited_too = in_doubt and exchange is not None and exchange.name == name
        self.refusals.accepted(name)
        self.settings.sent(exchange.command if exchange and awaited_too else command)
        return True

    def _take_answer(self, answer: Ok | Text, exchange: Exchange) -> bool:
        was_done = exchange.done
        taken = exchange.take(answer)
        if exchange.done and not was_done and exchange.refusal is None:
            self.refusals.accepted(exchange.name)
            self.settings.accepted(exchange.command)
            if isinstance(exchange.command, StableMode):
                # All lines before it were worked on. A renewal among them has had no OK, and
                # must not take the next one.
                self._accept(self.unconfirmed.take_all())
        return taken
