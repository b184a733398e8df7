"""A row of the transmit list as people write it: the words of `canmon send`.

>>> words = parse_row_text("123#00 --every 10ms --counter 0:0..14 --name alive")
>>> words.every, words.counters, words.name, str(words)
('10ms', ('0:0..14',), 'alive', '123#00 --every 10ms --counter 0:0..14 --name alive')
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.host.monitor.transmit.frame_fields import FrameFields, parse_checksum, parse_counter
from tickrig.host.monitor.transmit.pdo_frames import PdoFrames
from tickrig.host.monitor.transmit.transmit_list import ONCE, TransmitRow
from tickrig.host.text.values import parse_time_us
from tickrig.wire.can import CanFrame

OPTIONS: Final = ("every", "counter", "checksum", "name")


@dataclass(frozen=True, slots=True)
class RowText:
    """What a row says.

    Attributes:
        frame: a frame as `123#DEADBEEF`, or a PDO as `5.rpdo1 target_velocity=100`.
        every: its period as `10ms`; empty for a row that is sent by hand.
        counters: bytes that count, as `0:0..255`.
        checksums: bytes that are computed, as `7:crc8`.
        name: what people call it; empty for its frame.
    """

    frame: str
    every: str = ""
    counters: tuple[str, ...] = ()
    checksums: tuple[str, ...] = ()
    name: str = ""

    def __str__(self) -> str:
        """Write it in one line."""
        words = [self.frame]
        words += ["--every", self.every] if self.every else []
        words += [word for counter in self.counters for word in ("--counter", counter)]
        words += [word for checksum in self.checksums for word in ("--checksum", checksum)]
        words += ["--name", shlex.quote(self.name)] if self.name else []
        return " ".join(words)

    def row(self, pdos: PdoFrames) -> TransmitRow:
        """Return what is sent.

        Raises:
            ValueError: a frame, time or field that is none.
        """
        is_frame = "#" in self.frame
        frame = CanFrame.parse(self.frame) if is_frame else pdos.frame(self.frame)
        period_us = parse_time_us(self.every) if self.every else ONCE
        if self.every and period_us == ONCE:
            raise ValueError("--every takes a time above 0, as 10ms")
        fields = FrameFields(
            tuple(map(parse_counter, self.counters)), tuple(map(parse_checksum, self.checksums))
        )
        return TransmitRow(self.name or self.frame, frame, period_us, fields)


def parse_row_text(text: str) -> RowText:
    """Read a row; ValueError if it is none.

    What it says is not checked; `RowText.row` does that.
    """
    try:
        words = iter(shlex.split(text))
    except ValueError as error:
        raise ValueError(f"{text!r}: {str(error).lower()}") from None
    frame: list[str] = []
    found: Mapping[str, list[str]] = {name: [] for name in OPTIONS}
    for word in words:
        name = word.removeprefix("--")
        if name == word:
            frame.append(word)
        elif name in found:
            found[name].append(_value(word, next(words, None)))
        else:
            raise ValueError(f"no {word!r} here; known: --{', --'.join(OPTIONS)}")
    if not frame:
        raise ValueError("a row needs a frame as 123#DEADBEEF, or a PDO as 5.rpdo1 target=1")
    if len(frame) > 1 and "#" in frame[0]:
        raise ValueError(f"{frame[1]!r} behind a frame: a row has one frame")
    return RowText(
        " ".join(frame),
        _one("every", found["every"]),
        tuple(found["counter"]),
        tuple(found["checksum"]),
        _one("name", found["name"]),
    )


def _value(option: str, word: str | None) -> str:
    if word is None:
        raise ValueError(f"{option} says nothing")
    return word


def _one(name: str, words: list[str]) -> str:
    if len(words) > 1:
        raise ValueError(f"--{name} is given {len(words)} times")
    return "".join(words)
