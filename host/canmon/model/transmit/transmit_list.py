"""Frames that somebody at a panel sends: one by one, or cyclically, and only while it is armed.

>>> words = parse_row_text("123#00 --every 10ms --counter 0:0..14 --name alive")
>>> words.every, words.counters, words.name, str(words)
('10ms', ('0:0..14',), 'alive', '123#00 --every 10ms --counter 0:0..14 --name alive')
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from tickrig.host.canmon.model.transmit.frame_fields import (
    FrameFields,
    parse_checksum,
    parse_counter,
)
from tickrig.host.canmon.model.transmit.pdo_frames import PdoFrames
from tickrig.host.text.values import parse_time_with_unit_us
from tickrig.wire.can import CanFrame
from tickrig.wire.can_fd import FdFrame
from tickrig.wire.instant import NEVER

AnyFrames = tuple[CanFrame | FdFrame, ...]

ONCE: Final = 0
"""As a period: a row that is sent when somebody says so."""


@dataclass(slots=True)
class TransmitRow:
    """A frame that is sent by hand, or each period; the deadlines are absolute: it does not drift.

    A period that has passed whole is not made up for, it is counted.

    Args:
        name: what people call it.
        frame: what is sent.
        period_us: of a cyclic row, else `ONCE`.
        fields: what changes in it each time.
        due_us: when it is sent next, `NEVER` while it is not enabled.
        count: how often it is sent, 0 for ever.

    Attributes:
        sent: how often it was.
        missed: how many periods passed without it.

    Raises:
        ValueError: a period below 0, or a field that is not in the frame.
    """

    name: str
    frame: CanFrame | FdFrame
    period_us: int = ONCE
    fields: FrameFields = field(default_factory=FrameFields)
    due_us: int = NEVER
    count: int = 0
    sent: int = field(default=0, init=False)
    missed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Check the arguments."""
        if self.period_us < 0:
            raise ValueError(f"{self.name}: a period of {self.period_us} us; 0 is none")
        self.fields.check(len(self.frame.data))

    @property
    def enabled(self) -> bool:
        """Whether it is sent cyclically."""
        return self.due_us < NEVER

    def enable(self, now_us: int) -> None:
        """Send it from now on in each period; counters go on where they were.

        Raises:
            ValueError: it has no period.
        """
        if self.period_us == ONCE:
            raise ValueError(f"{self.name} has no period")
        if not self.enabled:
            self.due_us = now_us

    def disable(self) -> None:
        """Send it no more."""
        self.due_us = NEVER

    def once(self) -> AnyFrames:
        """Return it, to be sent now."""
        data = self.fields.put(self.frame.data, self.sent)
        self.sent += 1
        return (self.frame._replace(data=data),)

    def tick(self, now_us: int) -> AnyFrames:
        """Return it if it is due."""
        if now_us < self.due_us:
            return ()
        late = (now_us - self.due_us) // self.period_us
        self.missed += late
        self.due_us += (late + 1) * self.period_us
        out = self.once()
        if self.sent == self.count:
            self.disable()
        return out


@dataclass(slots=True)
class TransmitList:
    """Rows, and the key that arms them.

    Nothing is sent until it is armed; stopping disarms it and disables all rows, so that arming
    it again sends nothing by itself.

    Args:
        rows: the frames.

    Attributes:
        armed: rows may send.
    """

    rows: list[TransmitRow] = field(default_factory=list)
    armed: bool = field(default=False, init=False)

    @property
    def due_us(self) -> int:
        """When a row is sent next."""
        return min((row.due_us for row in self.rows), default=NEVER)

    def stop(self) -> None:
        """Send nothing more, whatever was enabled."""
        self.armed = False
        for row in self.rows:
            row.disable()

    def enable(self, number: int, now_us: int) -> None:
        """Send a row in each period from now on; ValueError if that must not be."""
        self._check_armed()
        self.rows[number].enable(now_us)

    def once(self, number: int) -> AnyFrames:
        """Return a row, to be sent now; ValueError if it is not armed."""
        self._check_armed()
        return self.rows[number].once()

    def tick(self, now_us: int) -> AnyFrames:
        """Return what is due, in the order of the rows."""
        return tuple(frame for row in self.rows for frame in row.tick(now_us))

    def _check_armed(self) -> None:
        if not self.armed:
            raise ValueError("not armed: nothing is sent")


HEAD: Final = f"{'SENDS':<6} {'FRAME':<26} {'EVERY':>9} {'SENT':>8} {'MISSED':>7}  NAME"
ON, OFF, BY_HAND = "[x]", "[ ]", " - "


def render_transmit(rows: Sequence[TransmitRow]) -> list[str]:
    """Return a head, and a line for each row."""
    return [HEAD, *map(_line, rows)]


def _line(row: TransmitRow) -> str:
    mark = BY_HAND if row.period_us == ONCE else ON if row.enabled else OFF
    every = "" if row.period_us == ONCE else f"{row.period_us / 1_000:g} ms"
    frame = str(row.frame) + "*" * (row.fields.counters + row.fields.checksums != ())
    name = "" if row.name == str(row.frame) else row.name
    line = f"{mark:<6} {frame:<26} {every:>9} {row.sent:>8} {row.missed:>7}  {name}"
    return line.rstrip()


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
        period_us = parse_time_with_unit_us(self.every) if self.every else ONCE
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
