"""Connectors to components that run elsewhere, as a system file names them, and their upkeep."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

import CosNaming
from omniORB import CORBA

from tickrig.host.cli.engine_options import Endpoint, parse_endpoint
from tickrig.host.rtc.engines.openrtm.connector_ends import CORBA_CDR, DATA_TYPE, INTERFACE
from tickrig.host.rtc.engines.openrtm.names import name_of
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference, carried, explain, nvlist
from tickrig.host.rtc.engines.openrtm.port_service import SystemPorts
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.data_port import DataPort
from tickrig.host.rtc.ports.port import AnyPort
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import Manager, RemoteConnection
from tickrig.host.rtc.system.peer_thread import PeerThread
from tickrig.host.text.log import log_of

_LOOK_US: Final = 1_000_000
"""Interval at which a connector is checked."""

_LOG: Final = log_of(__name__)

_USUAL: Final = {
    "dataport.dataflow_type": "push",
    "dataport.subscription_type": "flush",
    INTERFACE: CORBA_CDR,
}


class Peers:
    """Makes the connectors of a system to components in other processes, and renews lost ones.

    Each connector is checked once a second, in its own thread. A connector is made again if it
    could not be made before, or if the other process has restarted. If a connector was ended
    although the other process still runs, for example by a tool, it is not made again.

    Args:
        ports: ports of the system.
        manager: manager of the system. The wanted connectors are in `manager.remotes`.
        look_us: interval in us at which each connector is checked.

    Raises:
        RtcRefused: the path of a remote component is invalid.
    """

    def __init__(self, ports: SystemPorts, manager: Manager, look_us: int = _LOOK_US) -> None:
        wanted = [_Kept(one, ports, manager) for one in manager.remotes.connections]
        self._threads = [PeerThread(f"keeper of {one.name}", look_us) for one in wanted]
        for one, thread in zip(wanted, self._threads, strict=True):
            thread.submit(partial(one.look, thread.retry_s))

    def close(self) -> None:
        """Stop checking the connectors. The connectors stay."""
        for thread in self._threads:
            thread.close()


class _Kept:
    """A connector that is kept up.

    Attributes:
        name: name of the connector.
    """

    def __init__(self, wanted: RemoteConnection, ports: SystemPorts, manager: Manager) -> None:
        self._wanted, self._ports, self._manager = wanted, ports, manager
        self._server, self._path = parse_path(wanted.remote.path)
        self.name = f"{wanted.remote.name}.{wanted.remote_port}"
        self._peer: Reference = None
        self._made, self._reason = False, ""

    def look(self, again_s: float) -> float | None:
        """Make the connector if it is missing. Return None to stop checking it."""
        try:
            if self._made and self._peer is not None:
                if not self._is_there():
                    _LOG.info("%s: the connector was ended; it is not made again", self.name)
                    return None
            else:
                self._make()
        except CORBA.SystemException as error:
            self._failed(explain(error))
        except CORBA.UserException as error:
            self._failed(f"no such name: {type(error).__name__}")
        except (RtcRefused, TimeoutError) as error:
            self._failed(str(error))
        return again_s

    def _is_there(self) -> bool:
        """Return whether both sides have the connector. An exception means that a side is gone."""
        wanted = self._wanted.connector_id
        theirs = self._peer.get_connector_profile(wanted).connector_id == wanted
        return bool(theirs) and self._ports.calls.call(self._is_here)

    def _is_here(self) -> bool:
        port = self._manager.port(self._wanted.port)
        return port.find_connector(self._wanted.connector_id) is not None

    def _make(self) -> None:
        """Find the peer's port, and connect it unless it is still connected."""
        self._peer = peer = _port_of(self._find(), self._wanted.remote_port)
        if not self._is_there() and not self._connected(peer):
            self._peer, self._reason = None, self._reason or "refused"  # our port has logged why
            return
        log = _LOG.warning if self._reason else _LOG.info  # the end of a loss, or the first time
        log("%s: connected", self.name)
        self._made, self._reason = True, ""

    def _connected(self, peer: Reference) -> bool:
        """Connect the ports. Return whether they are connected."""
        ours, values = self._ports.calls.call(self._begin)
        rtc, wanted = stubs().rtc, self._wanted
        profile = rtc.ConnectorProfile(
            carried("name", wanted.name), wanted.connector_id, [ours, peer], nvlist(values)
        )
        code, _ = ours.connect(profile)
        return bool(code == rtc.RTC_OK)

    def _begin(self) -> tuple[Reference, dict[str, str]]:
        """Return the local port's service, and the properties.

        End remains of an earlier connector.
        """
        port: AnyPort = self._manager.port(self._wanted.port)
        if (left := port.find_connector(self._wanted.connector_id)) is not None:
            left.end()
        if (ours := self._ports.references.get(port)) is None:
            raise RtcRefused(f"{self._wanted.port} is not served")
        usual = {}
        if isinstance(port, DataPort):
            usual = {**_USUAL, DATA_TYPE: port.data_type.idl_id()}
        return ours, {**usual, **self._wanted.properties}

    def _find(self) -> Reference:
        """Return the component as registered in its name server."""
        orb: Orb = self._ports.orb
        where = orb.reference(f"corbaloc::{self._server}/NameService")
        root = where._narrow(CosNaming.NamingContext)
        if root is None:
            raise RtcRefused(f"{self._server} is no name service")
        found = root.resolve(name_of(self._path))
        component = None if found is None else found._narrow(stubs().rtc.RTObject)
        if component is None:
            raise RtcRefused(f"{self._wanted.remote.path} is no component")
        return component

    def _failed(self, reason: str) -> None:
        self._peer = None
        if reason != self._reason and not (self._made and self._reason):  # one line for each loss
            _LOG.warning("%s: %s; asked again every second", self.name, reason)
        self._reason = reason


def refuse_wrong_paths(manager: Manager) -> None:
    """Raise RtcRefused if a remote component has an invalid path."""
    for entry in manager.remotes.components:
        parse_path(entry.path)


def parse_path(path: str) -> tuple[Endpoint, str]:
    """Split a component's path, as in rtshell, into the name server and the name in that server.

    >>> parse_path("localhost:2809/robot.host_cxt/Joystick0.rtc")
    (Endpoint(host='localhost', port=2809), 'robot.host_cxt/Joystick0.rtc')

    Raises:
        RtcRefused: the text is not such a path.
    """
    server, _, name = path.lstrip("/").partition("/")
    if not name or not all(name.split("/")):
        raise RtcRefused(f"path {path!r} is not like localhost:2809/robot.host_cxt/Joystick0.rtc")
    try:
        return parse_endpoint(server), name
    except ValueError as error:
        raise RtcRefused(f"path {path!r}: {error}") from error


def _port_of(component: Reference, name: str) -> Reference:
    """Return the port of a component by its name without the component's name."""
    known: list[str] = []
    for port in filter(None, component.get_ports()):
        profile: Any = port.get_port_profile()
        known.append(str(profile.name).rpartition(".")[2])
        if known[-1] == name:
            return port
    raise RtcRefused(f"it has no port {name!r}; known: {', '.join(known) or 'none'}")
