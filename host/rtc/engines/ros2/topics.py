"""Readers and writers of the messages of one topic for its port, in the thread of the engine."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from math import isfinite
from typing import Any, Final

from cyclonedds.core import DDSException, Listener
from cyclonedds.internal import InvalidSample

from tickrig.host.rtc.engines.ros2.participant import HISTORY, DdsParticipant, reason_of
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry
from tickrig.host.rtc.states import PortStatus
from tickrig.host.rtc.system.peer_thread import PeerThread
from tickrig.host.text.log import log_of

# The writer of the messages of one port to its topic, in the thread of the engine.

_LOG: Final = log_of(__name__)


class TopicWriter:
    """Writer of a ROS 2 topic, which sends the values of an OutPort as messages.

    The topic is opened by the first message or by `open`. Call all methods in one thread.

    Args:
        participant: participant in the DDS domain.
        entry: port and topic of the writer.

    Attributes:
        entry: port and topic of the writer.
    """

    def __init__(self, participant: DdsParticipant, entry: TopicEntry) -> None:
        self._participant, self.entry = participant, entry
        self._writer: Any = None
        self._failed = self._closed = False

    def open(self) -> None:
        """Announce the endpoint to peers. Log failures in one line."""
        try:
            if not (self._failed or self._closed):
                self._writer = self._participant.writer(self.entry)
        except DDSException as error:
            self._failed = True
            _LOG.warning("%s: no topic %s: %s", self.entry, self.entry.topic, reason_of(error))

    def put(self, message: Any) -> PortStatus:
        """Write a message to the topic, without waiting for its readers.

        Returns:
            PORT_OK on success, INVALID_ARGS if a number of the message does not fit, BUFFER_TIMEOUT
            if too many messages already wait for readers, or PORT_ERROR if the topic cannot be
            opened.
        """
        if self._writer is None:
            self.open()
        if self._writer is None:
            return PortStatus.PORT_ERROR
        try:
            self._writer.write(message)
        except DDSException as error:
            late = error.code == DDSException.DDS_RETCODE_TIMEOUT
            return PortStatus.BUFFER_TIMEOUT if late else PortStatus.PORT_ERROR
        except Exception as error:  # whatever its encoder says of a value
            if not self._failed:
                _LOG.warning("%s: no %s: %s", self.entry, self.entry.type, error)
            self._failed = True
            return PortStatus.INVALID_ARGS
        return PortStatus.PORT_OK

    def matched(self) -> list[int]:
        """Return the instance handles of the matched peers, in any thread."""
        writer = self._writer
        return [] if writer is None else list(writer.get_matched_subscriptions())

    def close(self) -> None:
        """Remove the endpoint."""
        self._writer, self._closed = None, True


_SMALLEST: Final = 1.2e-38
"""Limit below which a float32 is denormal. No value on a robot is that small."""


class _Arrivals(Listener):
    """A signal that data arrived.

    DDS calls the signal in a thread of its own, where nothing else is done.
    """

    def __init__(self, notify: Callable[[], None]) -> None:
        self._notify = notify
        super().__init__()  # type: ignore[no-untyped-call] # untyped there

    def on_data_available(self, reader: Any) -> None:
        self._notify()


class TopicReader:
    """Reader of a ROS 2 topic, which calls a function with each message for an InPort.

    Call all methods except the constructor in the thread that is given as `thread`.

    Args:
        participant: participant in the DDS domain.
        entry: port and topic of the reader.
        thread: thread that reads the topic.
        put: function that is called with each message, and with None if no message came for too
            long.

    Attributes:
        entry: port and topic of the reader.
    """

    def __init__(
        self,
        participant: DdsParticipant,
        entry: TopicEntry,
        thread: PeerThread,
        put: Callable[[Any], object],
    ) -> None:
        self._participant, self.entry, self._thread = participant, entry, thread
        self._put = put
        self._reader: Any = None
        self._closed = self._spoilt = self._odd = self._watched = False
        self._heard_s, self._stop_s = 0.0, entry.stop_after_us / 1e6

    def open(self) -> None:
        """Announce the endpoint to peers. Log failures in one line."""
        try:
            if not self._closed:
                self._reader = self._participant.reader(
                    self.entry, _Arrivals(partial(self._thread.submit, self._take))
                )
        except DDSException as error:
            _LOG.warning("%s: no topic %s: %s", self.entry, self.entry.topic, reason_of(error))

    def matched(self) -> list[int]:
        """Return the instance handles of the matched peers, in any thread."""
        reader = self._reader
        return [] if reader is None else list(reader.get_matched_publications())

    def close(self) -> None:
        """Remove the endpoint."""
        self._reader, self._closed = None, True

    def _take(self) -> float | None:
        """Process received messages one by one. An invalid message does not affect others."""
        for _ in range(HISTORY):
            if self._reader is None or (found := self._take_one(self._reader)) is None:
                return None
            for message in found:
                if not isinstance(message, InvalidSample):  # only reports that a peer is gone
                    self._hand_on(message)
        return 0

    def _take_one(self, reader: Any) -> list[Any] | None:
        """Return the next message, or nothing for an invalid one, or None at the end."""
        try:
            return reader.take(1) or None
        except DDSException as error:
            self._warn_once(reason_of(error))
            return None
        except Exception as error:  # whatever its decoder says of bytes
            self._warn_once(str(error) or type(error).__name__)
            return []

    def _warn_once(self, reason: str) -> None:
        if not self._spoilt:
            text = "%s: what came on %s is no %s: %s"
            _LOG.warning(text, self.entry, self.entry.topic, self.entry.type, reason)
        self._spoilt = True

    def _hand_on(self, message: Any) -> None:
        if not self._odd and (odd := _odd_number(message)):
            self._odd = True
            text = "%s: %s on %s: an rclpy that puts an int into a float field sends this, and"
            text += " ROS_PYTHON_CHECK_FIELDS=1 in its environment finds it"
            _LOG.warning(text, self.entry, odd, self.entry.topic)
        self._put(message)
        self._heard_s = time.monotonic()
        if self._stop_s and not self._watched:
            self._watched = True
            self._thread.submit(self._watch)

    def _watch(self) -> float | None:
        """Reset the latest value when no message has come for too long."""
        left_s = self._heard_s + self._stop_s - time.monotonic()
        if left_s > 0 and not self._closed:
            return left_s
        self._watched = False
        if not self._closed:
            self._put(None)
        return None


def _odd_number(message: object, path: str = "") -> str:
    """Return the first impossible number of a message with its value, empty if there is none.

    Such a number is not finite, or so small that it is an integer reinterpreted as a float.
    Sequences are not checked, because a range without an echo is infinite (REP 117).
    """
    for name, value in vars(message).items():
        if isinstance(value, float):
            if not isfinite(value) or 0 < abs(value) < _SMALLEST:
                return f"{path}{name} is {value:g}"
        elif hasattr(value, "__dict__") and (odd := _odd_number(value, f"{path}{name}.")):
            return odd
    return ""
