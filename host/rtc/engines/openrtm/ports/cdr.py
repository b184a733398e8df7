"""InPortCdr and OutPortCdr: what calls them at a peer, and what answers here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Protocol

from omniORB import CORBA

from tickrig.host.rtc.engines.openrtm.orb import Reference, explain
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.states import PortStatus
from tickrig.host.text.log import log_of

_LOG: Final = log_of(__name__)

_GONE: Final = (
    CORBA.TRANSIENT,
    CORBA.TIMEOUT,
    CORBA.COMM_FAILURE,
    CORBA.OBJECT_NOT_EXIST,
)
"""With these a peer gave no answer; all else that it raises is one."""

_EMPTY: Final = (PortStatus.BUFFER_EMPTY, PortStatus.BUFFER_TIMEOUT)


class NoAnswerError(Exception):
    """A peer is not there, hangs, or has no such object any more."""


class _Complaints:
    """Logs the first of what a peer does wrong, and again after it did something right."""

    def __init__(self, peer: str) -> None:
        self._peer, self._complained = peer, False

    def wrong(self, what: str) -> None:
        if not self._complained:
            _LOG.warning("%s: %s", self._peer, what)
        self._complained = True

    def right(self) -> None:
        self._complained = False

    def raised(self, error: CORBA.SystemException) -> None:
        """Take what a call raised; NoAnswerError if that is no answer."""
        if isinstance(error, _GONE):
            raise NoAnswerError(explain(error)) from None
        self.wrong(f"the peer answers with {type(error).__name__}")


class InPortClient:
    """Puts values into the InPort of a peer (OpenRTM-aist, InPortCorbaCdrConsumer).

    Args:
        reference: of an InPortCdr.
        peer: its port, for people.
    """

    def __init__(self, reference: Reference, peer: str) -> None:
        self._put: Callable[[bytes], Any] = reference.put
        self._complaints = _Complaints(peer)

    def put(self, payload: bytes) -> PortStatus:
        """Put a value; NoAnswerError if there was none."""
        try:
            status = self._put(payload)
        except CORBA.SystemException as error:
            self._complaints.raised(error)
            return PortStatus.PORT_ERROR
        self._complaints.right()
        return _ours(status)


class OutPortClient:
    """Gets values from the OutPort of a peer (OpenRTM-aist, OutPortCorbaCdrConsumer).

    Args:
        reference: of an OutPortCdr.
        peer: its port, for people.
    """

    def __init__(self, reference: Reference, peer: str) -> None:
        self._get: Callable[[], tuple[Any, bytes]] = reference.get
        self._complaints = _Complaints(peer)

    def get(self) -> bytes | None:
        """Get a value, None if there is none; NoAnswerError without an answer."""
        try:
            status, payload = self._get()
        except CORBA.BAD_PARAM:  # OpenRTM-aist-Python 2.1.0 returns "" for an empty buffer
            return None
        except CORBA.SystemException as error:
            self._complaints.raised(error)
            return None
        if _ours(status) is PortStatus.PORT_OK:
            self._complaints.right()
            return payload
        if _ours(status) not in _EMPTY:
            self._complaints.wrong(f"the peer answers with {status}")
        return None


class _Put(Protocol):
    def put(self, payload: bytes, /) -> PortStatus: ...


class _Get(Protocol):
    def get(self) -> tuple[PortStatus, bytes | None]: ...


class InPortAnswers:
    """The operations of InPortCdr, carried out by a connector."""

    def __init__(self, connector: _Put) -> None:
        self._put, self._theirs = connector.put, _theirs()

    def put(self, data: bytes) -> Any:
        """Take a value from a peer."""
        return self._theirs[self._put(data)]


class OutPortAnswers:
    """The operations of OutPortCdr, carried out by a connector."""

    def __init__(self, connector: _Get) -> None:
        self._get, self._theirs = connector.get, _theirs()

    def get(self) -> tuple[Any, bytes]:
        """Give a value to a peer."""
        status, payload = self._get()
        return self._theirs[status], payload or b""


def _theirs() -> dict[PortStatus, Any]:
    """Return OpenRTM's status for each of ours; it has no word for some."""
    openrtm = stubs().openrtm
    return {one: getattr(openrtm, one.name, openrtm.UNKNOWN_ERROR) for one in PortStatus}


def _ours(status: Any) -> PortStatus:
    """Return our status for one of OpenRTM's; `UNKNOWN_ERROR` is an error."""
    return PortStatus.__members__.get(str(status), PortStatus.PORT_ERROR)
