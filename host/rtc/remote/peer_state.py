"""Whether the peer of a connector answers."""

from __future__ import annotations

import time
from enum import StrEnum
from typing import Final

from tickrig.host.rtc.states import PortStatus
from tickrig.host.text.log import log_of

_LOG: Final = log_of(__name__)


class PeerState(StrEnum):
    """What is known of a peer."""

    CONNECTED = "connected"  # it answered the latest call, or none was made
    LOST = "lost"  # the latest call had no answer


class PeerWatch:
    """Notes how each call into a peer ended; a peer that goes or comes back is logged in a line.

    One thread notes, any thread looks.

    Args:
        who: the connector, for people.

    Attributes:
        state: of the peer.
        status: what the latest call gave; CONNECTION_LOST without an answer.
    """

    def __init__(self, who: str) -> None:
        self._who, self._lost_s = who, 0.0
        self.state, self.status = PeerState.CONNECTED, PortStatus.PORT_OK

    def answered(self, status: PortStatus) -> None:
        """Note an answer."""
        if self.state is PeerState.LOST:
            gone_s = time.monotonic() - self._lost_s
            _LOG.warning("%s: the peer answers again, after %.1f s", self._who, gone_s)
        self.state, self.status = PeerState.CONNECTED, status

    def unanswered(self, error: Exception) -> None:
        """Note that there was no answer, and why."""
        if self.state is PeerState.CONNECTED:
            reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
            _LOG.warning("%s: the peer does not answer: %s", self._who, reason)
            self._lost_s = time.monotonic()
        self.state, self.status = PeerState.LOST, PortStatus.CONNECTION_LOST
