"""PortService: how tools and peers join a port of ours (OMG RTC 1.0; OpenRTM-aist, PortBase)."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, Final

from omniORB import CORBA

from tickrig.host.rtc.engines.openrtm.orb import explain
from tickrig.host.rtc.engines.openrtm.ports.peer_connections import (
    PeerConnection,
    PeerConnections,
    Profile,
)
from tickrig.host.rtc.engines.openrtm.ports.properties import changed, completed, texts
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.port import AnyPort
from tickrig.host.rtc.remote.call_queue import CallQueue
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.text.log import log_of

_LOG: Final = log_of(__name__)

_OK: Final = ReturnCode.RTC_OK
_NAME_LENGTH: Final = 100


class PortAnswers:
    """The operations of PortService, in threads of the ORB.

    What concerns the port is done in the manager's thread; peers are called here, and nothing is
    locked meanwhile: the call that goes round may come back.

    Args:
        port: of ours.
        connections: its connectors with peers.
        calls: those of the manager's thread.
        describe: returns the PortProfile, in the manager's thread.
    """

    def __init__(
        self,
        port: AnyPort,
        connections: PeerConnections,
        calls: CallQueue,
        describe: Callable[[], Any],
    ) -> None:
        self._last_line = ""
        self._port, self._connections, self._calls, self._describe = (
            port,
            connections,
            calls,
            describe,
        )

    def get_port_profile(self) -> Any:
        """Return what the port is."""
        return self._calls.call(self._describe)

    def get_connector_profiles(self) -> list[Profile]:
        """Return its connectors."""
        return self._calls.call(self._connections.profiles)

    def get_connector_profile(self, connector_id: str) -> Profile:
        """Return a connector; without one of this ID one that is empty."""
        for profile in self.get_connector_profiles():
            if profile.connector_id == connector_id:
                return profile
        return stubs().rtc.ConnectorProfile("", "", [], [])

    def connect(self, profile: Profile) -> tuple[Any, Profile]:
        """Join the ports of a connector; an ID and the byte orders are filled in."""
        profile.connector_id = profile.connector_id or str(uuid.uuid4())
        profile.properties = completed(profile.properties)
        if not profile.ports or profile.ports[0] is None:
            return _code(ReturnCode.BAD_PARAMETER), profile
        try:
            answer: tuple[Any, Profile] = profile.ports[0].notify_connect(profile)
        except CORBA.SystemException as error:
            self._log("its first port: %s", explain(error))
            self.notify_disconnect(profile.connector_id)
            return _code(ReturnCode.RTC_ERROR), profile
        return answer

    def notify_connect(self, profile: Profile) -> tuple[Any, Profile]:
        """Join our port with a connector, and have the port after it do the same."""
        code, values = _OK, texts(profile.properties)
        try:
            name = _peer_name(profile, self._port.full_name)
            connection = self._calls.call(partial(self._connections.reserve, profile, values, name))
            if connection is not None:
                profile = self._join(connection, profile)
            self._last_line = ""
        except RtcRefused as error:
            self._log("%s", error)
            code = error.code
        except TimeoutError:
            self._log("%s", "the system is busy")
            code = ReturnCode.RTC_ERROR
        except CORBA.SystemException as error:
            self._log("the peer: %s", explain(error))
            code = ReturnCode.RTC_ERROR
        return _code(code), profile

    def disconnect(self, connector_id: str) -> Any:
        """End a connector: the first port that answers tells those after it."""
        profile = self.get_connector_profile(connector_id)
        for port in profile.ports:
            with suppress(CORBA.SystemException):
                return port.notify_disconnect(connector_id)
        return _code(ReturnCode.RTC_ERROR if profile.ports else ReturnCode.BAD_PARAMETER)

    def disconnect_all(self) -> Any:
        """End all connectors."""
        codes = [self.disconnect(one.connector_id) for one in self.get_connector_profiles()]
        return next((code for code in codes if code != _code(_OK)), _code(_OK))

    def notify_disconnect(self, connector_id: str) -> Any:
        """End a connector of our port, and have the port after it do the same."""
        connection, known = self._calls.call(partial(self._connections.look, connector_id))
        if not known:
            return _code(ReturnCode.BAD_PARAMETER)
        if connection is not None and connection.place == 0 and connection.profile is not None:
            connection.notify_peer()
        self._calls.call(partial(self._connections.end, connector_id))
        return _code(_OK)

    def _join(self, connection: PeerConnection, profile: Profile) -> Profile:
        """Have the peer join, then join our end; if that fails nothing is left of either."""
        asked = False
        try:
            profile.properties = changed(profile.properties, connection.additions)
            if connection.place == 0:
                asked, ports = True, profile.ports
                code, profile = connection.peer.notify_connect(profile)
                _refuse(connection.peer_name, code)
                profile.connector_id, profile.ports = connection.connector_id, ports
            values = texts(profile.properties)
            self._calls.call(partial(self._connections.keep, connection, profile, values))
        except Exception:
            if asked:
                connection.notify_peer()
            with suppress(RtcRefused):  # the system has ended
                self._calls.post(partial(self._connections.drop, connection))
            raise
        return profile

    def _log(self, text: str, reason: object) -> None:
        """Log why the port is not connected, unless that was the reason the last time."""
        line = f"{self._port.full_name} is not connected: {text % reason}"
        if line != self._last_line:
            _LOG.warning("%s", line)
        self._last_line = line


def _refuse(peer: str, code: Any) -> None:
    """Raise RtcRefused with the code of a peer unless that is RTC_OK."""
    if (ours := ReturnCode.__members__.get(str(code), ReturnCode.RTC_ERROR)) is not _OK:
        raise RtcRefused(f"{peer} answers {ours.name}", ours)


def _code(code: ReturnCode) -> Any:
    """Return the ReturnCode_t of CORBA."""
    return getattr(stubs().rtc, code.name)


def _peer_name(profile: Profile, our_name: str) -> str:
    """Return the name of the peer's port: tools name a connector after both, `A0.out_B0.in`.

    For a connector without a name the peer is asked, unless it is the one that calls.
    """
    if rest := _line(profile.name.removeprefix(our_name).removesuffix(our_name).strip("_")):
        return rest
    with suppress(CORBA.SystemException):
        if len(profile.ports) == 2 and profile.ports[1] is not None:
            name = _line(profile.ports[1].get_port_profile().name)
            if name not in {"", our_name}:
                return name
    return _line(profile.connector_id)


def _line(text: str) -> str:
    """Return a text of a peer as it may stand in a line of a log."""
    return " ".join(text.split())[:_NAME_LENGTH]
