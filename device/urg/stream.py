"""What a sensor was asked to measure: one scan, or one after the other."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.urg.view import View
from tickrig.wire.sensors.scip import status
from tickrig.wire.sensors.scip.command import Command
from tickrig.wire.sensors.scip.reply import Reply
from tickrig.wire.sensors.scip.scan import WIDTHS, encode_scan

WIDEST = {2: 0xFFF, 3: 0x3_FFFF}
"""The most that so many characters carry; what is farther reads so."""


@dataclass(slots=True)
class Stream:
    """A command that measures.

    Attributes:
        command: as it came, without flaw.
        begins_us: ends of scans before that are not for it.
        left: scans that remain, 0 if they have no end.
        skipped: scans that are still left out.
    """

    command: Command
    begins_us: int
    left: int = 0
    skipped: int = 0

    @property
    def endless(self) -> bool:
        """Whether it goes on until it is told to stop."""
        return self.command.fields[-1] == "00"

    def reply(self, view: View, code: str, echo: bytes) -> bytes:
        """Return a scan as it was asked for."""
        first, last, cluster = (int(text) for text in self.command.fields[:3])
        width = WIDTHS[self.command.symbol[1]]
        numbers, widest = view.distances(first, last, cluster), WIDEST[width]
        if max(numbers, default=0) > widest:
            numbers = tuple(min(number, widest) for number in numbers)
        return Reply(echo, code, encode_scan(view.time_ms, numbers, width)).encode()

    def answer(self, view: View) -> bytes:
        """Return the scan of GD or GS."""
        return self.reply(view, status.OK, self.command.echo)

    def refuse(self, code: str) -> bytes:
        """Return why there will be no scan."""
        return Reply(self.command.echo, code).encode()

    def take(self, ended_us: int, view: View) -> bytes:
        """Return what is sent of a scan of MD or MS."""
        if ended_us < self.begins_us:
            return b""
        if self.skipped:
            self.skipped -= 1
            return b""
        self.skipped = int(self.command.fields[3])
        self.left -= not self.endless
        return self.reply(view, status.DATA, self.echo)

    @property
    def echo(self) -> bytes:
        """The command with the scans that remain."""
        head, command = self.command.parameters[:-2], self.command
        return Command(command.symbol, f"{head}{self.left:02}", command.string).echo
