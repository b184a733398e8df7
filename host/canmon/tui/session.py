"""A source that a thread reads, and the frames that are sent on its buses."""

from __future__ import annotations

import os
import shlex
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from tickrig._lazy import LazyModule
from tickrig.host.canmon.extensions import make_decoder
from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.eds_folder import EdsFiles
from tickrig.host.canmon.model.decode.node_board import NodeBoard
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import STAMPS, AnyRecord, Record, Stamp
from tickrig.host.canmon.model.logs.log_file import Mark
from tickrig.host.canmon.model.top_model import TopModel
from tickrig.host.canmon.model.trace import FrameTrace
from tickrig.host.canmon.model.traffic import BitRates
from tickrig.host.canmon.model.transmit import AnyFrames
from tickrig.host.canmon.output.listening import Stopwatch
from tickrig.host.canmon.sources.source import STDIN, AnySource, StdinSource, open_any
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import SourceFailed
from tickrig.wire.can import CanFrame, FdFrame
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.host.canmon.sources import bus_source
    from tickrig.host.canmon.sources.bus_source import OpenBus
else:  # python-can is slow
    bus_source = LazyModule("tickrig.host.canmon.sources.bus_source")


# Theory of operation
# ===================
#
# One thread reads the source, decodes, counts and sends; the other paints the screen. They share
# the model and the tasks under one lock (`Session.lock`): hold it to read the model or to use a
# task. `armed` is the exception: it is a plain flag that is checked again before each frame is
# sent, and that the end of the program clears without the lock, so that it does not wait for a busy
# session.
#
# A step: wait for a frame, or until a task is due; then, under the lock, frames go to the model and
# to every task in the order of arrival, and tasks return frames to send; these are sent outside the
# lock. Sending may block on a slow bus, and the screen must not.
#
# Frames that this program sends are added to the records of the next step (`_echo`), with the time
# of the source, because a bus does not return a program's own frames. Tasks receive them, too.
#
# Two times: `now_us` of the session, on a monotonic clock, is for tasks; `model.now_us` is the time
# at the source, that of the frames, and continues while a live source has no frames.
#
# Nothing is sent before `arm`, and `disarm` stops all tasks, so arming again sends nothing by
# itself. Frames that tasks return while disarmed are counted as withheld. A bus that fails to send
# disarms, and reports why.

DecodedFrame = tuple[Record, Decoded]
"""A frame and its meaning."""


class Model:
    """The traffic, decoded and counted.

    Args:
        eds: content of EDS files by node-ID.
        dbc: DBC files.
        bit_rate: bit rate of the buses, or None if unknown.
        data_bit_rate: bit rate of the data phase of CAN FD frames with BRS, or None if unknown.

    Attributes:
        eds: content of EDS files by node-ID.
        decoder: decoder of all frames.
        board: board with the nodes.
        top: traffic, and the settings of its display in the statistics.
        trace: trace of the latest frames.
        frames: number of frames, including error frames.
        now_us: time at the source.
        lost: number of frames that were lost before they were read.
        unread: number of items that were not frames of CAN or CAN FD.
        failed: reason why the source ended early, empty if it did not.
        ended: whether the source has ended.
        away: buses that went away and are not back.
    """

    def __init__(
        self,
        eds: Mapping[int, EdsObjects] | None = None,
        dbc: Sequence[Path] = (),
        bit_rate: int | None = None,
        data_bit_rate: int | None = None,
    ) -> None:
        self.eds = eds if isinstance(eds, EdsFiles) else EdsFiles(eds)
        self.decoder = make_decoder(self.eds, dbc)
        self.board = NodeBoard(self.decoder, {node: found.name for node, found in self.eds.items()})
        self.top = TopModel(BitRates(bit_rate, data_bit_rate))
        self.trace = FrameTrace()
        self.frames = self.now_us = self.lost = self.unread = 0
        self.failed, self.ended = "", False
        self.away: Sequence[str] = ()

    def take(self, records: Sequence[AnyRecord]) -> list[DecodedFrame]:
        """Process records. Return the frames with their meanings."""
        decoded_frames: list[DecodedFrame] = []
        for record in records:
            if isinstance(record, Record):
                decoded = self.decoder.take(record)
                self.board.take(record, decoded)
                self.trace.take(record, decoded)
                decoded_frames.append((record, decoded))
            else:
                self.trace.take(record, record.decoded)
                self.top.take((record,))
        self.top.take_decoded(decoded_frames)
        self.frames += len(decoded_frames)
        if records:
            self.now_us = records[-1].at_us
        return decoded_frames


_POLL_US: Final = 20_000
_MARKS_KEPT: Final = 1_000
_SILENT_US: Final = 3_000_000

_Send = Callable[[CanFrame | FdFrame], None]
"""Function that sends a frame on one bus. It raises SourceFailed if sending fails."""


class Task(Protocol):
    """An activity of the monitor that receives all frames, and may send frames.

    The thread of the session calls the task.

    Attributes:
        channel: name of the bus on which the task sends, empty for the first bus.
    """

    channel: str = ""

    @property
    def due_us(self) -> int:
        """Time at which the session calls the task even if no frame arrives, or `NEVER`."""
        return NEVER

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> AnyFrames:
        """Process new frames, and return the frames to send.

        Args:
            now_us: present time on the clock of the session. The time stamps of the frames have
                another clock.
            records: frames since the last call, including frames that this program sent.
        """

    def stop(self) -> None:
        """Stop sending, because the operator has disarmed the session."""
        return


class Session:
    """A session that reads a source, feeds the model and the tasks, and sends frames of the tasks.

    While the session is not armed, nothing is sent. Frames of tasks are withheld, and counted. Hold
    `lock` to read the model or to use a task.

    Args:
        source: source of the frames.
        model: model that processes the frames.
        buses: buses to send on, by channel, or an empty mapping for a log.
        clock: function that returns the time of the session in microseconds.

    Attributes:
        lock: lock that protects the model and the tasks.
        tasks: tasks that process records and return frames to send.
        marks: marks about buses that went away or came back, until a task takes them.
        armed: whether frames are sent.
        sent: number of sent frames.
        withheld: number of frames that were not sent because the session was not armed.
        trouble: reason why a frame could not be sent, empty if all frames could be sent.
        notes: messages for the user, until they are shown.
        stamp: format of times in all tabs.
        words: options and SOURCE words that name the buses on a command line.
    """

    def __init__(
        self,
        source: AnySource[AnyRecord],
        model: Model,
        buses: Mapping[str, _Send] | None = None,
        clock: Callable[[], int] = lambda: time.monotonic_ns() // 1_000,
    ) -> None:
        self.source, self.model, self.buses = source, model, dict(buses or {})
        self.lock = threading.RLock()
        self.tasks: list[Task] = []
        self.marks: deque[Mark] = deque(maxlen=_MARKS_KEPT)
        self.armed, self.trouble = False, ""
        self.sent = self.withheld = 0
        self.stamp = Stamp.ZERO
        self.words: tuple[str, ...] = ()
        self.notes: deque[str] = deque(maxlen=_MARKS_KEPT)
        model.eds.notify = self.notes.append
        self._clock, self._watch = clock, Stopwatch()
        self._begun_us = clock()
        self._echo: list[Record] = []
        self._stop, self._pool = threading.Event(), ThreadPoolExecutor(1, "canmon")
        self._thread: Future[None] | None = None

    @property
    def now_us(self) -> int:
        """Time of the session, used by tasks."""
        return self._clock()

    @property
    def silent(self) -> bool:
        """Whether no frame has arrived for some seconds since a bus was opened.

        The trace tab then shows a hint.
        """
        waited_us = self._clock() - self._begun_us
        return self.source.live and not self.model.frames and waited_us > _SILENT_US

    @property
    def scan_command(self) -> str:
        """The command that finds the nodes of the first bus."""
        bus = next(iter(self.buses), "")
        return shlex.join(["canmon", "net", *(self.words or (bus,)), "scan"])

    @property
    def can_send(self) -> bool:
        """Whether there is a bus to send on."""
        return bool(self.buses)

    @property
    def origin_us(self) -> int:
        """The time of the first frame."""
        return self.model.trace.origin_us or 0

    def next_stamp(self) -> None:
        """Switch to the next format of displayed times.

        The formats are: since the first frame, since the previous frame, absolute.
        """
        self.stamp = STAMPS[(STAMPS.index(self.stamp) + 1) % len(STAMPS)]

    def next_bus(self, bus: str) -> str:
        """Return the name of the next bus. The first bus follows the last bus."""
        names = list(self.buses) or [""]
        place = names.index(bus) if bus in names else 0
        return names[(place + 1) % len(names)]

    def arm(self) -> None:
        """Allow tasks to send, if there is a bus."""
        with self.lock:
            self.armed, self.trouble = self.can_send, ""

    def disarm(self) -> None:
        """Stop all tasks. Nothing is sent from now on."""
        with self.lock:
            self.armed = False
            for task in self.tasks:
                task.stop()

    @property
    def started(self) -> bool:
        """Whether the thread is reading."""
        return self._thread is not None

    def over(self, model: Model) -> Session:
        """Return a new session that passes the frames of the same source to a new model.

        It is used when the user changes the EDS or DBC files while the source is running. Close the
        present session before you use the new one.
        """
        session = Session(self.source, model, self.buses, self._clock)
        session.words = self.words
        return session

    def resume(self, source: AnySource[AnyRecord], buses: Mapping[str, _Send]) -> None:
        """Continue after `close` with a source that was opened again."""
        self.source, self.buses = source, dict(buses)
        self._stop, self._pool = threading.Event(), ThreadPoolExecutor(1, "canmon")
        if self.started:
            self.start()

    def feed(self, records: Sequence[AnyRecord]) -> None:
        """Process frames that were received before."""
        with self.lock:
            self._take(records)

    def start(self) -> None:
        """Start to read in a separate thread."""
        self._thread = self._pool.submit(self._run)

    def check(self) -> None:
        """Raise the error that ended the thread, if there was one."""
        if self._thread is not None and self._thread.done():
            self._thread.result()

    def close(self) -> None:
        """End the thread, and stop sending. The source stays open for the final report."""
        self.armed = False  # else a slow bus would take all that is due first
        self._stop.set()
        self._pool.shutdown()

    def step(self, timeout_us: int = 0) -> None:
        """Wait for a frame or a due task, then process all frames that have arrived.

        The tasks also get the frames, and may return frames, which are then sent. `timeout_us` is
        the longest time to wait.
        """
        due_us = min((task.due_us for task in self.tasks), default=NEVER)
        records = self.source.poll(max(0, min(timeout_us, due_us - self._clock())))
        with self.lock:
            model, source = self.model, self.source
            self.marks.extend(source.marks)
            out = self._take([*self._echo, *records])
            model.lost, model.unread = source.lost, source.unread
            model.failed, model.ended = source.failed, source.ended
            model.away = source.away
        for channel, frame in out:
            self._send(channel, frame)

    def _run(self) -> None:
        while not self._stop.is_set():
            self.step(_POLL_US)
            if self.source.ended:
                self._stop.wait(_POLL_US / 1e6)

    def _take(self, records: Sequence[AnyRecord]) -> list[tuple[str, CanFrame | FdFrame]]:
        self._echo = []
        self._watch.take(records)
        decoded_frames = self.model.take(records)
        if self.source.live:
            self.model.now_us = self._source_us()
        now_us = self._clock()
        wanted = [
            (task.channel, frame)
            for task in self.tasks
            if decoded_frames or task.due_us <= now_us
            for frame in task.tick(now_us, decoded_frames)
        ]
        if self.armed:
            return wanted
        self.withheld += len(wanted)
        return []

    def _send(self, channel: str, frame: CanFrame | FdFrame) -> None:
        if not self.armed:  # all was stopped in between
            self.withheld += 1
            return
        name = channel or next(iter(self.buses))
        try:
            self.buses[name](frame)
        except SourceFailed as error:
            self.disarm()
            self.trouble = error.message
            return
        self.sent += 1
        self._echo.append(Record(self._source_us(), name, frame, sent=True))

    def _source_us(self) -> int:
        """Return the time at the source.

        Until a frame has a time, it is the time of this machine.
        """
        return self._watch.now_us if self._watch.latest_us else time.time_ns() // 1_000


_TERMINAL: Final = "/dev/tty"


def open_session(words: Sequence[str], options: BusOptions, model: Model) -> Session:
    """Open the source that SOURCE words name, and return a session of the monitor that reads it.

    Nothing is sent until the user arms the session.

    Raises:
        Refused: the words do not name a source, or the sources cannot be combined.
        SourceFailed: a bus or file cannot be opened.
    """
    if list(words) == ["-"]:
        return Session(StdinSource(_take_pipe()), model)
    source = open_any(words, options)
    sends = {name: partial(_send, bus) for name, bus in source.buses.items()}
    session = Session(source, model, sends)
    if source.live:
        session.words = (*options.arguments(), *words[:1])
    return session


def empty_session(model: Model) -> Session:
    """Return a session that reads nothing, until settings name a source."""
    source = AnySource[AnyRecord]()
    source.close()
    return Session(source, model)


def _send(bus: OpenBus, frame: CanFrame | FdFrame) -> None:
    """Send a frame on a bus that may have been opened again."""
    bus_source.send_on(bus.bus, bus.name, frame)


def _take_pipe() -> int:
    """Read the keys from the terminal. Return the new file descriptor of the pipe."""
    try:
        terminal = os.open(_TERMINAL, os.O_RDWR)
    except OSError as error:
        raise SourceFailed(f"{_TERMINAL}: {error.strerror}") from error
    pipe = os.dup(STDIN)
    os.dup2(terminal, STDIN)
    os.close(terminal)
    return pipe
