"""Reading from a source, with or without a screen, and how reading ends."""

from __future__ import annotations

import ctypes
import os
import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Final, ParamSpec, Self, TypeVar

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.traffic import BitRates
from tickrig.host.canmon.sources.source import AnySource, BlockLog, BusSpec, parse_source
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import SourceFailed
from tickrig.host.cli.options import time_option
from tickrig.host.cli.start import Interrupter, give_up_terminals, taking_signals
from tickrig.host.links.ready import ready
from tickrig.host.links.terminal import TerminalOutput, take_keys
from tickrig.host.text.page_text import in_cells
from tickrig.host.text.values import counted

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_traffic
    from tickrig.host.canmon.model.columns import columns as column_frames
    from tickrig.host.canmon.model.columns.columns import Columns
    from tickrig.host.canmon.model.frames import AnyRecord, LineRecord
    from tickrig.host.canmon.model.traffic import TrafficSnapshot
    from tickrig.host.canmon.output.printer import FilteredDecoder
else:  # numpy
    column_frames = LazyModule("tickrig.host.canmon.model.columns.columns")
    column_traffic = LazyModule("tickrig.host.canmon.model.columns.column_traffic")


# A terminal that is painted line by line: only lines that changed are written.


ENTER: Final = "\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[2J"
"""Codes for the alternate screen, without cursor and line wrapping, and for clearing it."""

LEAVE: Final = "\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l"
_CLEAR: Final = "\x1b[2J"

_ARROWS: Final = {"\x1b[A": "k", "\x1b[B": "j", "\x1b[5~": "p", "\x1b[6~": "f"}
"""Keys that send several characters, and the keys that they stand for."""

_KEY: Final = re.compile(r"\x1b\[[0-9;]*[A-Za-z~]|.", re.DOTALL)
_COLOUR: Final = re.compile(r"(\x1b\[(?:[07]|3[1-6])m)")
_TERMINAL: Final = "/dev/tty"
_PATIENCE_S: Final = 0.02


class _Screen:
    """The controlling terminal, even if standard input is a pipe.

    The terminal is restored at the end, also after errors. A stuck terminal does not block the
    program. No new picture is written until the terminal has accepted the last picture.

    Raises:
        OSError: there is no terminal.
    """

    def __init__(self) -> None:
        self._terminal = os.open(_TERMINAL, os.O_RDWR)
        self._output = TerminalOutput(self._terminal)
        self._painted: list[str] = []
        self._size = (0, 0)

    def __enter__(self) -> Self:
        """Switch the terminal to the screen."""
        self._give_back = take_keys(self._terminal)
        self._output.write(ENTER)
        return self

    def __exit__(self, *of_block: object) -> None:
        """Restore the terminal."""
        self._output.write(LEAVE, last=True)
        if not self._output.close():
            give_up_terminals()
        self._give_back()
        os.close(self._terminal)

    @property
    def is_gone(self) -> bool:
        """Whether the terminal was closed."""
        return self._output.gone

    def size(self) -> tuple[int, int]:
        """Return the columns and lines of the terminal, or 80 x 24 if the terminal is gone."""
        with suppress(OSError):
            return os.get_terminal_size(self._terminal)
        return (80, 24)

    def keys(self) -> list[str]:
        """Return the pressed keys, or none if the terminal is gone."""
        text = ""
        with suppress(OSError):
            if ready([self._terminal], wait_s=0)[0]:
                text = os.read(self._terminal, 1_024).decode("utf-8", "replace")
        return [_ARROWS.get(key, key) for key in _KEY.findall(text)]

    def paint(self, lines: Sequence[str]) -> None:
        """Show lines of text.

        If the terminal has not yet accepted the previous lines, the new lines are not shown.
        Control codes in the lines have no effect, except those of colours.
        """
        if not self._output.catches_up(_PATIENCE_S):
            return
        lines, size = list(map(_painted, lines)), self.size()
        before = self._painted if size == self._size else []
        text = _difference(before, lines)
        self._output.write(text if size == self._size else _CLEAR + text)
        self._painted, self._size = lines, size


def _painted(line: str) -> str:
    r"""Return a line without control codes, except the colours of this program.

    >>> _painted("\x1b[7m01\x1b[0m \x1b]52;c;\a")
    '\x1b[7m01\x1b[0m ␛]52;c;␇'
    """
    pieces = _COLOUR.split(line)
    return "".join(one if place % 2 else in_cells(one) for place, one in enumerate(pieces))


def _difference(before: Sequence[str], lines: Sequence[str]) -> str:
    r"""Return the text that changes the displayed lines to new lines.

    >>> _difference(["a", "b", "c"], ["a", "x"])
    '\x1b[2;1Hx\x1b[K\x1b[3;1H\x1b[K'
    """
    shown = [*lines, *[""] * (len(before) - len(lines))]
    return "".join(
        f"\x1b[{place};1H{line}\x1b[K"
        for place, line in enumerate(shown, 1)
        if place > len(before) or line != before[place - 1]
    )


# The clocks of verbs: of a source between its frames, and of what is sent.


class Stopwatch:
    """Clock that continues the time stamps of a live source while no frame arrives.

    The time is that of the latest time stamp, plus the time that has passed since then on the clock
    of this machine, in microseconds. The two clocks may show different times, so only time
    differences of the machine's clock are used.

    Attributes:
        latest_us: time stamp of the latest frame in microseconds.
    """

    def __init__(self) -> None:
        self.latest_us, self._since_us = 0, _now_us()

    def take(self, records: Sequence[Record | LineRecord]) -> None:
        """Continue from the last of these frames."""
        if records:
            self.latest_us, self._since_us = records[-1].at_us, _now_us()

    @property
    def now_us(self) -> int:
        """The time at the source."""
        return self.latest_us + _now_us() - self._since_us


def _now_us() -> int:
    return time.monotonic_ns() // 1_000


_PR_SET_TIMERSLACK: Final = 29
_SLACK_NS: Final = 1_000


class Pace:
    """Clock for actions at given times, in microseconds since its creation.

    Each wait ends at an absolute time, so that the times of repeated actions do not drift.
    """

    def __init__(self) -> None:
        self._start_ns = time.monotonic_ns()
        _wake_on_time()

    @property
    def now_us(self) -> int:
        """Current time of the clock."""
        return (time.monotonic_ns() - self._start_ns) // 1_000

    def wait_until(self, at_us: int) -> int:
        """Wait until the time is `at_us`. Return the delay in microseconds."""
        early_us = at_us - self.now_us
        if early_us > 0:
            time.sleep(early_us / 1e6)
        return max(0, self.now_us - at_us)


def _wake_on_time() -> None:
    """Ask Linux not to extend sleeps of this thread by up to 50 us.

    The system call is prctl(2) with PR_SET_TIMERSLACK.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, _SLACK_NS, 0, 0, 0)


Given = ParamSpec("Given")
_Result = TypeVar("_Result")


class _FramesLost(click.ClickException):
    """Frames were lost.

    The error prints one line on standard error, with exit status 4.
    """

    exit_code = 4


def report(source: AnySource[object], strict: bool, more: Iterable[str] = ()) -> None:
    """Print notes about a source at its end, such as lost or invalid frames, and close the source.

    Raises:
        SourceFailed: the source ended early.
        _FramesLost: `strict` is set, and frames were lost or could not be read.
    """
    source.close()
    for word in (*source.messages(), *more):
        click.echo(word, err=True)
    if source.failed:
        raise SourceFailed(source.failed)
    missing = [f"{source.lost} frames were lost"] if source.lost else []
    missing += [f"a bus was away {counted(source.gaps, 'time')}"] if source.gaps else []
    missing += [f"{source.unread} lines or frames passed over"] if source.unread else []
    if strict and missing:
        raise _FramesLost(", ".join(missing))


def expect_frames(source: AnySource[object], meaning: FilteredDecoder | None = None) -> None:
    """Exit with status 1 if no frame of a log passed the filters or the time range.

    The function `report` prints the message about this.
    """
    nothing = source.nothing_passed or (meaning is not None and meaning.nothing_passed)
    if nothing and (source.recorded or not source.live):
        raise click.exceptions.Exit(_NOT_COME)


class _Interruptions(Interrupter):
    """Ctrl-C and other signals that end a program, either at once or after the present work.

    Attributes:
        came: whether a signal has arrived.
    """

    def __init__(self) -> None:
        super().__init__()
        self._held = self.came = False

    def received(self, number: int, frame: FrameType | None) -> None:
        """Process a signal."""
        self.came = True
        if self._held:
            give_up_terminals()
        else:
            super().received(number, frame)

    def behind(self, act: Callable[Given, _Result]) -> Callable[Given, _Result]:
        """Return a function that calls `act` and cannot be interrupted.

        An interruption during the call takes effect after the call.
        """

        def whole(*arguments: Given.args, **named: Given.kwargs) -> _Result:
            self._held = True
            try:
                result = act(*arguments, **named)
            finally:
                self._held = False
            if self.came:
                raise KeyboardInterrupt
            return result

        return whole


@contextmanager
def until_interrupted() -> Iterator[_Interruptions]:
    """Context manager whose block ends at Ctrl-C or a termination signal.

    After the block, the program continues.
    """
    interruptions = _Interruptions()
    # In this order, Ctrl-C before the block ends the command.
    with taking_signals(interruptions.received), suppress(KeyboardInterrupt):
        yield interruptions


_Item = TypeVar("_Item", bound="AnyRecord")

_POLL_US: Final = 20_000
_NOT_COME: Final = 1
_PATIENCE_US: Final = 5_000_000
"""Time to listen to a bus if nothing else ends listening."""


span_option: Final = time_option(
    "--for", "span_us", help="End after TIME, such as 10s. For a log, its timestamps count."
)
"""Decorator that adds the option `--for`, in microseconds."""


def bit_rates_of(words: Sequence[str], options: BusOptions) -> BitRates:
    """Return the nominal and the data bit rate of a bus.

    Each bit rate comes from its option. If the option is missing, the bit rate comes from a SOURCE
    word such as can0@500k/2M.
    """
    buses = [word for word in map(parse_source, words) if isinstance(word, BusSpec)]
    nominal = [options.bitrate, *(bus.bitrate for bus in buses)]
    fast = [options.data_bitrate, *(bus.data_bitrate for bus in buses)]
    return BitRates(*(next(filter(None, rates), None) for rates in (nominal, fast)))


def follow(  # noqa: PLR0913 - how, on a screen and without
    source: AnySource[_Item],
    words: Sequence[str],
    take: Callable[[Sequence[_Item]], None],
    span_us: int | None,
    lines: _Lines | None = None,
    *,
    press: Callable[[str], None] = lambda key: None,
) -> None:
    """Read a source and process its frames for a command.

    The reading ends with the source, after the duration, or when the user interrupts.

    Args:
        source: source of the frames.
        words: SOURCE words that name the source.
        take: function that is called with each batch of records.
        span_us: duration in microseconds, or None if the user gave no duration.
        lines: function that returns status lines, which are shown on a terminal while the source is
            live.
        press: function that is called with each key that the user presses on the terminal.
    """
    with until_interrupted():
        if lines is not None and source.live and sys.stdout.isatty():
            _paint(source, take, lines, span_us, press)
        else:
            listen(source, take, span_us or patience_us(source, words))


def listen(
    source: AnySource[_Item], take: Callable[[Sequence[_Item]], None], span_us: int | None
) -> None:
    """Read a source and pass its frames to `take`, until the source ends or `span_us` has passed.

    For a log, `span_us` is a time span of the log, measured by the times of its frames.
    """
    begin_s, last_us = time.monotonic(), None
    while not (source.ended or (source.live and _is_over(begin_s, span_us))):
        records = source.poll(_POLL_US)
        if span_us is not None and not source.live and records:
            last_us = records[0].at_us + span_us if last_us is None else last_us
            late = [at for at, one in enumerate(records) if one.at_us > last_us]
            take(records[: late[0]] if late else records)
            if late:
                return
        else:
            take(records)
        say_marks(source)


def say_marks(source: AnySource[object]) -> None:
    """Report on standard error which buses went away or are back."""
    for mark in () if source.recorded else source.marks:
        click.echo(mark.text, err=True)


def take_blocks(log: BlockLog, take: Callable[[Columns], None], span_us: int | None = None) -> bool:
    """Read a log in blocks, until it ends, `span_us` has passed, or the user interrupts.

    Args:
        log: log that is read in blocks.
        take: function that is called with each block.
        span_us: duration in microseconds by the times of the log, or None for the whole log.

    Returns:
        False if the log contains CAN FD frames. The whole log must then be read frame by frame.
    """
    last_us: int | None = None
    with until_interrupted():
        while not log.ended:
            for block in log.poll(0):
                if span_us is not None and len(block):
                    last_us = int(block.at_us[0]) + span_us if last_us is None else last_us
                    inside = block.at_us <= last_us
                    late, rows = (~inside).nonzero()[0], inside.nonzero()[0]
                    if len(late):
                        take(column_frames.select(block, rows[rows < late[0]]))
                        return True
                take(block)
    return not log.no_columns


def count_blocks(log: BlockLog | None, span_us: int | None) -> TrafficSnapshot | None:
    """Return the traffic statistics of a log that is read in blocks.

    The result is None if `log` is None, or if the log must be read frame by frame.
    """
    if log is None:
        return None
    traffic = column_traffic.ColumnTraffic()
    return traffic.snapshot() if take_blocks(log, traffic.take, span_us) else None


def patience_us(source: AnySource[object], words: Sequence[str]) -> int | None:
    """Return how long a command listens by default in microseconds, or None for no limit.

    Files and pipes have no limit, because they end.
    """
    return None if not source.live or list(words) == ["-"] else _PATIENCE_US


def _is_over(begin_s: float, span_us: int | None) -> bool:
    """Return whether a time has passed by the clock of this machine."""
    return span_us is not None and time.monotonic() >= begin_s + span_us / 1e6


_PAINT_S: Final = 0.1
_QUIT: Final = "q"

_Lines = Callable[[int, int, int], list[str]]
"""Function that returns the lines to show at a time, for a screen of a given size."""


def _paint(
    source: AnySource[_Item],
    take: Callable[[Sequence[_Item]], None],
    lines: _Lines,
    span_us: int | None,
    press: Callable[[str], None] = lambda key: None,
) -> None:
    """Update the display until q is pressed, the source ends or the time has passed.

    Args:
        source: live source of the frames.
        take: function that is called with the records.
        lines: function that returns the lines to show.
        span_us: duration, or None for no end.
        press: function that is called with other keys. The display is updated at once.
    """
    watch, begin_s, due_s = Stopwatch(), time.monotonic(), 0.0
    with _Screen() as screen:
        while not (source.ended or screen.is_gone or _is_over(begin_s, span_us)):
            records = source.poll(_POLL_US)
            take(records)
            watch.take(records)
            keys = screen.keys()
            if _QUIT in keys:
                break
            for key in keys:
                press(key)
            if keys or time.monotonic() >= due_s:
                due_s = time.monotonic() + _PAINT_S
                screen.paint(lines(watch.now_us, *screen.size()))
