"""A host of an infra-red ucode reader that waits for nothing: look for rounds later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.host.links.link import Link
from tickrig.wire.errors import WireError
from tickrig.wire.sensors.ucode import LineType, UcodeLine, parse_line
from tickrig.wire.serial.lines import LineSplitter

SILENCE_US: Final = 1_000_000
"""How long there may be no good line: ten rounds."""


@dataclass(frozen=True, slots=True)
class Round:
    """What a reader received in one round.

    Attributes:
        number: counted by the reader, 0..65535.
        ucodes: the nearest marker first, each with the level of its signal in per cent.
        blinded: too much light left nothing to be received.
    """

    number: int
    ucodes: tuple[tuple[str, int], ...] = ()
    blinded: bool = False


class UcodeReaderClient:
    """Lets a reader listen, and takes its rounds.

    A round of which a line was lost or garbled is left out. After a second without a good line
    it begins again, and so again and again. What waited on the line before it began is dropped:
    the robot was elsewhere then.

    Args:
        link: the line.

    Raises:
        LinkClosed: the line is gone.

    Attributes:
        garbled: lines that were none.
        incomplete: rounds that were left out.
        restarts: how often it began again.
    """

    def __init__(self, link: Link[bytes]) -> None:
        self._link, self._lines = link, LineSplitter(256)
        self.garbled = self.incomplete = self.restarts = 0
        link.receive(0)
        self._begin()

    def poll(self) -> list[Round]:
        """Return the rounds that have come.

        Raises:
            LinkClosed: the line is gone.
        """
        rounds: list[Round] = []
        for raw in self._lines.push(self._link.receive(0)):
            try:
                line = parse_line(raw)
            except WireError:
                self.garbled += 1
            else:
                self._received_us = self._link.now_us
                rounds += self._take(line)
        if self._link.now_us - self._received_us > SILENCE_US:
            self.restarts += 1
            self._begin()
        return rounds

    def close(self) -> None:
        """Let it listen no more, and give the line back."""
        self._link.send(b"\nOFF\n")
        self._link.close()

    def _begin(self) -> None:
        self._received_us = self._link.now_us
        self._begun: list[UcodeLine] = []
        self._link.send(b"\nON\n")

    def _take(self, line: UcodeLine) -> list[Round]:
        match line:
            case UcodeLine(LineType.UCODE):
                self._begun.append(line)
            case UcodeLine(LineType.READER, (_, _, _, 0)):
                self._link.send(b"ON\n")
            case UcodeLine(LineType.LIGHT, (int(number),)):
                return self._ended(Round(number, blinded=True), 0)
            case UcodeLine(LineType.ROUND, (int(number), int(count))):
                return self._ended(self._round(number), count)
            case _:  # who it is, or that it did not understand
                pass
        return []

    def _round(self, number: int) -> Round:
        lines = [line.fields for line in self._begun if line.fields[0] == number]
        return Round(number, tuple((str(ucode), int(level)) for _, ucode, level in lines))

    def _ended(self, found: Round, count: int) -> list[Round]:
        whole = len(found.ucodes) == count == len(self._begun)
        self.incomplete += not whole
        self._begun = []
        return [found] if whole else []
