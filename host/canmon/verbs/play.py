"""The verb `play`, which sends the frames of a log again."""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.logs.log_reader import LogReader, read_log
from tickrig.host.canmon.model.traffic import bucket_of, middle_us
from tickrig.host.canmon.output.listening import Pace, until_interrupted
from tickrig.host.canmon.sources.source import FileSpec, parse_source
from tickrig.host.canmon.verbs.decode_options import log_time_option
from tickrig.host.cli.can_options import BusOptions, bus_options, fd_options
from tickrig.host.cli.messages import Refused, SourceFailed, refusing, until_unread
from tickrig.host.cli.options import refuse_idle
from tickrig.wire.can import CanFrame, ErrorFrame, FdFrame
from tickrig.wire.errors import FieldError, WireError

if TYPE_CHECKING:
    from tickrig.host.canmon.sources import bus_source
else:  # python-can is slow
    bus_source = LazyModule("tickrig.host.canmon.sources.bus_source")


# Frames of a log with the bus and the time of sending.

_FOREVER: Final = 0
"""Value of `loops` for a replay without an end."""

_LEAST_LOOP_US: Final = 1_000


class _Due(NamedTuple):
    """A frame to send.

    Attributes:
        at_us: time of sending since the start of the replay.
        channel: bus to send on.
        frame: frame to send.
    """

    at_us: int
    channel: str
    frame: CanFrame | FdFrame


@dataclass(slots=True)
class ReplayPlan:
    """Frames of a log in the order of the log. Times of the frames never go back.

    Args:
        log: frames of the log, which are read again for each loop.
        route: function that returns the bus on which to send the frames of a recorded bus, or None
            to omit them.
        speed: factor of the speed, or 0 for no pauses.
        from_us: start of the span to send, counted from the first frame.
        to_us: end of the span to send, counted from the first frame, or None for the end of the
            log.
        loops: number of loops, or `_FOREVER` to repeat until the replay is stopped. A loop begins
            where the previous loop ends, which is at `to_us`, or else at the last frame. A loop
            begins at least 1 ms after the start of the previous loop.

    Attributes:
        left_out: number of omitted frames in the span, which are error frames and frames of other
            buses.

    Raises:
        ValueError: the span is empty, or the speed is below 0.
    """

    log: Iterable[Record]
    route: Callable[[str], str | None]
    speed: float = 1.0
    from_us: int = 0
    to_us: int | None = None
    loops: int = 1
    left_out: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Check the arguments."""
        if self.speed < 0:
            raise ValueError(f"speed {self.speed:g}; 0 is as fast as can be, 1 as recorded")
        if self.to_us is not None and self.to_us <= self.from_us:
            raise ValueError(f"from {self.from_us} us to {self.to_us} us there is nothing")

    def __iter__(self) -> Iterator[_Due]:
        """Yield the frames. A log without any frame ends also an endless replay."""
        begin_us, loop = 0, 0
        while self.loops == _FOREVER or loop < self.loops:
            end_us, sent = begin_us, False
            for at_us, record in self._span():
                end_us = begin_us + at_us
                channel = self.route(record.channel)
                if channel is None or isinstance(record.frame, ErrorFrame):
                    self.left_out += 1
                    continue
                sent = True
                yield _Due(self._scaled(end_us), channel, record.frame)
            if not sent:
                return
            loop += 1
            end_us = end_us if self.to_us is None else begin_us + self.to_us - self.from_us
            begin_us = max(end_us, begin_us + _LEAST_LOOP_US)

    def _span(self) -> Iterator[tuple[int, Record]]:
        """Yield the frames in the span, with their times after the start of the span."""
        first_us: int | None = None
        latest_us = 0
        for record in self.log:
            first_us = record.at_us if first_us is None else first_us
            latest_us = max(latest_us, record.at_us - first_us)
            if self.to_us is not None and latest_us > self.to_us:
                return
            if latest_us >= self.from_us:
                yield latest_us - self.from_us, record

    def _scaled(self, at_us: int) -> int:
        return round(at_us / self.speed) if self.speed else 0


_EXACT_US: Final = 100_000


class Lateness:
    """Statistics of how late the frames of a replay were sent.

    Attributes:
        count: number of frames that were counted.
        max_us: longest delay in microseconds.
        last_us: latest delay in microseconds. At the end of a replay, it shows how far the replay
            has drifted.
    """

    def __init__(self) -> None:
        self._counts: Counter[int] = Counter()
        self.count = self.max_us = self.last_us = 0

    def add(self, late_us: int) -> None:
        """Count a delay. An early frame counts as on time."""
        self.last_us = late_us = max(0, late_us)
        self.count += 1
        self.max_us = max(self.max_us, late_us)
        exact = late_us <= _EXACT_US
        self._counts[late_us if exact else max(_EXACT_US, middle_us(bucket_of(late_us)))] += 1

    def percentile_us(self, percent: float) -> int:
        """Return a percentile of the delays in microseconds, or 0 if nothing was counted.

        The result is the delay that `percent` (0 to 100) of the delays do not exceed.
        """
        left = self.count * percent / 100
        for late_us, count in sorted(self._counts.items()):
            left -= count
            if left <= 0:
                return min(late_us, self.max_us)
        return self.max_us

    def __str__(self) -> str:
        """Return the statistics in words."""
        p50, p99 = self.percentile_us(50), self.percentile_us(99)
        return f"late p50 {p50} us, p99 {p99} us, max {self.max_us} us; last {self.last_us} us"


_POLL_US: Final = 100_000
_NOTHING_SENT: Final = 1
_CAN_ID: Final = re.compile(r"[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8}")


def _log_path(word: str) -> Path:
    """Return the log file that a word names. Raise Refused if it does not name one."""
    parsed = parse_source(word)
    if not isinstance(parsed, FileSpec):
        raise Refused(f"{word!r} is no log file")
    return parsed.path


@click.command()
@click.argument("log")
@click.argument("buses", nargs=-1, metavar="[BUS|BUS=RECORDED...]")
@click.option(
    "--speed",
    default="1",
    metavar="FACTOR",
    help="Speed factor, such as 2, or max for no gaps.  [1]",
)
@log_time_option(
    "--from",
    "begin",
    help="Begin at TIME in a log, such as 2.5 (s after the first frame) or a date.",
)
@log_time_option("--to", "end", help="End at TIME, written as for --from.")
@click.option("--loop", default="1", metavar="N", help="Play the log N times, or forever.  [1]")
@click.option("--step", is_flag=True, help="Wait for Enter before each frame.")
@click.option("--wait-rx", metavar="ID", help="Begin when CAN-ID ID, such as 581, is received.")
@bus_options
@fd_options
def command(log: str, buses: Sequence[str], step: bool, **options: Any) -> None:
    """Send the frames of LOG again, with the gaps that were recorded.

    With BUS=RECORDED, the frames that were recorded on the bus RECORDED are sent on BUS. With BUS
    alone, the frames of all other recorded buses are sent on BUS. Frames of recorded buses without
    a BUS are not sent. Instead of these arguments, -c names one bus for all frames. Error frames
    are not sent. At the end, the command reports how late the frames were sent.

    \b
    canmon play run.log vcan0
    canmon play run.log vcan2=can0 vcan3=can1 --speed 2 --loop forever
    canmon play run.blf can0 --from 3s --to 9s --wait-rx 581
    """  # noqa: D301 - click wants the backspace
    if step:
        refuse_idle("--step waits for Enter, not for a time", "speed")
    wait_rx = _can_id(options.pop("wait_rx"))
    words, route = _routes(buses, options["channel"])
    path = _log_path(log)
    reader = read_log(path)
    plan = _plan(reader, route, options)
    receives = wait_rx is not None
    with bus_source.transmitters(words, BusOptions(**options), receives=receives) as opened:
        ended = _play(
            plan, {word or "": bus for word, bus in zip(words, opened, strict=True)}, step, wait_rx
        )
    for word in reader.tally.messages(str(path)):
        click.echo(word, err=True)
    if not ended:
        raise click.exceptions.Exit(_NOTHING_SENT)


def _routes(
    words: Sequence[str], channel: str | None
) -> tuple[list[str | None], Callable[[str], str | None]]:
    """Return the buses to open, and the bus for each recorded bus. None is the bus of -c."""
    if channel is not None:
        if words:
            raise Refused(f"-c {channel} names the bus: leave out {' '.join(words)}, or -c")
        return [None], lambda recorded: ""
    if not words:
        raise click.UsageError("Missing argument 'BUS|BUS=RECORDED...'.")
    recorded: dict[str, str] = {}
    rest: str | None = None
    for word in words:
        bus, equals, channel = word.rpartition("=")
        if not equals:
            if rest is not None:
                raise Refused(f"{rest} and {word} both take all of it; write {word}=RECORDED")
            rest = word
        elif not bus or channel in recorded:
            raise Refused(f"{word!r} is not BUS=RECORDED, once for each recorded bus")
        else:
            recorded[channel] = bus
    buses = dict.fromkeys([*recorded.values(), *([rest] if rest else [])])
    return list(buses), lambda channel: recorded.get(channel, rest)


def _plan(
    log: LogReader, route: Callable[[str], str | None], options: dict[str, Any]
) -> ReplayPlan:
    speed, loop, begin, end = (options.pop(name) for name in ("speed", "loop", "begin", "end"))
    dated = any(time is not None and time.dated for time in (begin, end))
    first_us = _first_us(log) if dated else 0
    with refusing():
        return ReplayPlan(
            log,
            route,
            _speed(speed),
            0 if begin is None else max(0, begin.after(first_us) - first_us),
            None if end is None else end.after(first_us) - first_us,
            _loops(loop),
        )


def _first_us(log: LogReader) -> int:
    """Return the time of the first frame. Raise SourceFailed if the log cannot be read."""
    with _failing():
        return next((record.at_us for record in log), 0)


def _speed(text: str) -> float:
    try:
        speed = 0.0 if text == "max" else float(text)
    except ValueError:
        speed = -1.0
    if not (text == "max" or 1e-6 <= speed <= 1e6):
        raise Refused(f"--speed {text!r} is neither a factor above 0, as 2 or 0.5, nor max")
    return speed


def _loops(text: str) -> int:
    if text == "forever":
        return _FOREVER
    if not (text.isdecimal() and int(text)):
        raise Refused(f"--loop {text!r} is neither 1 or more nor forever")
    return int(text)


def _can_id(text: str | None) -> CanFrame | None:
    """Return a frame with the expected CAN-ID."""
    if text is None:
        return None
    with refusing("--wait-rx", WireError):
        if _CAN_ID.fullmatch(text) is None:
            raise FieldError(f"{text!r} is no CAN-ID of 3 or 8 hex digits, as 581")
        return CanFrame.parse(f"{text}#")


def _play(
    plan: ReplayPlan,
    buses: dict[str, bus_source.Transmitter],
    step: bool,
    wait_rx: CanFrame | None,
) -> bool:
    """Send the planned frames. Return False if the log contained nothing to send."""
    late, pace = Lateness(), Pace()
    with until_interrupted() as signals, until_unread():
        if wait_rx is not None:
            _wait_for(wait_rx, list(buses.values()))
            pace = Pace()
        for at_us, channel, frame in _due(plan):
            if step:
                _confirm(f"{buses[channel].name} {frame}")
                at_us = pace.now_us  # noqa: PLW2901 - now is when it is due
            late.add(pace.wait_until(at_us))
            buses[channel].send(frame)
    summary = [f"{late.count} frames in {pace.now_us / 1e6:.3f} s"]
    summary += [str(late)] if plan.speed and not step else []
    summary += [f"{plan.left_out} left out"] if plan.left_out else []
    click.echo("; ".join(summary), err=True)
    return bool(late.count) or step or signals.came


def _due(plan: ReplayPlan) -> Iterator[_Due]:
    """Yield the planned frames. Raise SourceFailed if the log cannot be read."""
    with _failing():
        yield from plan


@contextmanager
def _failing() -> Iterator[None]:
    """Raise SourceFailed if the block cannot read a log."""
    try:
        yield
    except OSError as error:
        raise SourceFailed(f"{error.filename}: {error.strerror}") from error
    except LogError as error:
        raise SourceFailed(str(error)) from error


def _wait_for(wanted: CanFrame, buses: Sequence[bus_source.Transmitter]) -> None:
    """Wait until one of the buses carries a frame with this CAN-ID."""
    while True:
        for bus in buses:
            for _, _, frame, _ in bus.poll(_POLL_US // len(buses)):
                if isinstance(frame, CanFrame) and _same_id(frame, wanted):
                    return


def _same_id(one: CanFrame, other: CanFrame) -> bool:
    return (one.can_id, one.extended) == (other.can_id, other.extended)


def _confirm(what: str) -> None:
    """Show the next frame, and wait for Enter. The end of the input ends the replay."""
    click.echo(what)
    if not sys.stdin.readline():
        raise KeyboardInterrupt
