"""An engine that serves the components of a manager as RTCs of OpenRTM while it runs."""

# Theory of operation
#
# omniORB speaks GIOP; this package has the servants that it calls, and the calls to peers. There
# are three kinds of threads, and one rule: only the manager's thread accesses components, ports and
# the manager.
#
#   threads of the ORB    run the servants (manager, rt_object, context, configuration,
#                         port_service). A servant works by `calls.call(...)`: the manager's thread
#                         executes it between two ticks. A call that takes too long is TIMEOUT.
#   the manager's thread  ticks, and serves those calls while it waits. It never calls a peer.
#   threads for peers     make all calls into peers (system/peer_thread.py): `submit` returns at
#                         once. A peer that hangs delays only its own calls, for the 1 s of a CORBA
#                         call.
#
# Connecting is an exception: `notify_connect` is passed from port to port, and returns the
# properties that each port added. A thread of the ORB makes this call without holding a lock,
# because the peer may call back before it answers. So a connector is made in two steps: `reserve`
# checks it and serves the objects for the peer; `keep` joins it with the peer's answer. If a step
# fails, `drop` reverts the first step and notifies the peer.
#
# The first port in the list connects the other one and notifies it of the end. Two local ports are
# recognized by their object keys and joined directly, without CORBA.
#
# Data are bytes of CDR (`InPortCdr`, `OutPortCdr`). They are encoded in the manager's thread when a
# port is written, and decoded in the thread of the ORB that receives them. Received data do not
# wake the manager, because no code reads them before the next tick. `Arrivals` delivers them at the
# beginning of that tick.
#
# Stubs are compiled from Tickrig's IDL files (stubs.py), so an installation without omniORB lacks
# only this engine. A process has one ORB at most: the engine closes all that it opened, in the
# reverse order.

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tickrig.host.cli.engine_options import OpenRtmOptions, format_name
from tickrig.host.rtc.component import ExecutionContext, ModuleSpec, RtComponent
from tickrig.host.rtc.engines.openrtm import configuration, context, manager, rt_object
from tickrig.host.rtc.engines.openrtm.context import AttachedContexts, ServantReferences
from tickrig.host.rtc.engines.openrtm.names import NameServer
from tickrig.host.rtc.engines.openrtm.orb import Orb
from tickrig.host.rtc.engines.openrtm.peers import Peers, refuse_wrong_paths
from tickrig.host.rtc.engines.openrtm.port_service import ComponentPorts, SystemPorts
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.manager import Manager


@dataclass(slots=True)
class _Served:
    servant: rt_object.RtObjectServant
    contexts: list[ExecutionContext]
    path: str


class _OpenRtmEngine:
    """An engine that registers a manager's components with a name server, and serves them to peers.

    Create and close the engine in the manager's thread.

    Args:
        options: addresses and names of the engine.
        rtcs: manager of the components.
        calls: queue that runs calls in the manager's thread.
        stop: function that ends the process if a peer requests that.
        fixed: whether peers cannot create or end components.

    Raises:
        OrbFailed: no ORB can be made at the address.
        RtcRefused: the stubs cannot be made, or the path of a remote component is invalid.
    """

    def __init__(
        self,
        options: OpenRtmOptions,
        rtcs: Manager,
        calls: CallQueue,
        stop: Callable[[], object],
        *,
        fixed: bool = False,
    ) -> None:
        self._rtcs, self._calls, self._options = rtcs, calls, options
        self._served: dict[RtComponent, _Served] = {}
        refuse_wrong_paths(rtcs)  # before there is an ORB, which would have to be closed
        idl = stubs()
        self._orb = Orb(options.endpoint)
        self._references = ServantReferences(self._orb, idl, calls, fixed=fixed)
        self._ports = SystemPorts(self._orb, calls, rtcs)
        self._names = NameServer(self._orb, options.name_server)
        servant = manager.ManagerServant(rtcs, self._references, stop)
        reference = self._orb.serve_as(manager.NAME, idl.skeleton(manager.INTERFACE), servant)
        context, _, _ = self._path(manager.NAME, manager.SPEC).rpartition("/")
        self._names.bind(f"{context}/{manager.NAME}.mgr".lstrip("/"), reference)
        for component in rtcs.components:
            self._add(component)
        rtcs.on_added.append(self._add)
        rtcs.on_removed.append(self._remove)
        self._peers = Peers(self._ports, rtcs)

    def close(self) -> None:
        """Remove the names, answer the running calls, and refuse all other calls."""
        self._rtcs.on_added.remove(self._add)
        self._rtcs.on_removed.remove(self._remove)
        self._peers.close()
        self._ports.close()
        self._calls.close()
        self._names.close()
        self._orb.close()

    def _add(self, component: RtComponent) -> None:
        references = self._references
        servant = rt_object.RtObjectServant(component, self._rtcs, references)
        contexts = AttachedContexts(component, self._rtcs, references)
        answers = configuration.ConfigurationServant(
            component.configuration, self._calls, references.stubs
        )
        servant.configuration = self._orb.serve(
            references.stubs.skeleton(configuration.INTERFACE), answers
        )
        reference = references.enter(component, rt_object.INTERFACE, servant, contexts)
        servant.ports = ComponentPorts(self._ports, component, reference)
        for one in component.contexts:
            self._add_context(one, component)
        path = self._path(component.instance_name, component.spec)
        self._served[component] = _Served(servant, list(component.own_contexts), path)
        self._names.bind(path, reference)
        self._rtcs.path_uris[component.instance_name] = f"{self._options.name_server}/{path}"

    def _add_context(self, one: ExecutionContext, component: RtComponent) -> None:
        if self._references.of(one) is None:
            owner = component if one in component.own_contexts else None
            servant = context.ExecutionContextServant(one, owner, self._references)
            self._references.enter(one, context.INTERFACE, servant)

    def _remove(self, component: RtComponent) -> None:
        served = self._served.pop(component)
        self._names.unbind(served.path)
        del self._rtcs.path_uris[component.instance_name]
        for one in served.contexts:
            self._references.remove(one)
        self._references.remove(component)
        self._orb.withdraw(served.servant.configuration)
        if served.servant.ports is not None:
            served.servant.ports.close()

    def _path(self, name: str, spec: ModuleSpec) -> str:
        values = {
            "n": name,
            "t": spec.type_name,
            "m": spec.type_name,
            "v": spec.version,
            "V": spec.vendor,
            "c": spec.category,
            "h": socket.gethostname(),
            "M": manager.NAME,
            "p": str(os.getpid()),
        }
        return format_name(self._options.names, values)


@contextmanager
def openrtm_joined(
    options: OpenRtmOptions,
    rtcs: Manager,
    calls: CallQueue,
    stop: Callable[[], object],
    *,
    fixed: bool,
) -> Iterator[None]:
    """Join the components of a manager to an OpenRTM system; see `_OpenRtmEngine`."""
    engine = _OpenRtmEngine(options, rtcs, calls, stop, fixed=fixed)
    try:
        yield
    finally:
        engine.close()
