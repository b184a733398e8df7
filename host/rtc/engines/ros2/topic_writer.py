"""What writes the messages of one port to its topic, in the thread of the engine."""

from __future__ import annotations

from typing import Any, Final

from cyclonedds.core import DDSException

from tickrig.host.rtc.engines.ros2.participant import Participant, reason_of
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry
from tickrig.host.rtc.states import PortStatus
from tickrig.host.text.log import log_of

_LOG: Final = log_of(__name__)


class TopicWriter:
    """Writes to a topic; it is opened with the first message, or by `open`.

    All of it is called in one thread.

    Args:
        participant: takes part in the domain.
        entry: port and topic.

    Attributes:
        entry: as given.
    """

    def __init__(self, participant: Participant, entry: TopicEntry) -> None:
        self._participant, self.entry = participant, entry
        self._writer: Any = None
        self._failed = self._closed = False

    def open(self) -> None:
        """Be there for peers; what cannot be is logged in a line."""
        try:
            if not (self._failed or self._closed):
                self._writer = self._participant.writer(self.entry)
        except DDSException as error:
            self._failed = True
            _LOG.warning("%s: no topic %s: %s", self.entry, self.entry.topic, reason_of(error))

    def put(self, message: Any) -> PortStatus:
        """Write a message; nothing waits for those who read it.

        Returns:
            INVALID_ARGS if a number of it does not fit, BUFFER_TIMEOUT if too much waits for
            readers already, PORT_ERROR if the topic cannot be.
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
        """Return the instance handles of the peers that it is joined with, in any thread."""
        writer = self._writer
        return [] if writer is None else list(writer.get_matched_subscriptions())

    def close(self) -> None:
        """Be gone."""
        self._writer, self._closed = None, True
