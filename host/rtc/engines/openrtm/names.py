"""The names of components in a CORBA name server while the components live."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Lock
from typing import Any, Final

import CosNaming
from omniORB import CORBA

from tickrig.host.cli.engine_options import Endpoint
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference, explain
from tickrig.host.rtc.system.peer_thread import PeerThread
from tickrig.host.text.log import log_of

_RENEW_US: Final = 10_000_000
"""OpenRTM's `naming.update.interval`. A restarted name server is filled again within this time."""

_LOOK_US: Final = 1_000_000
_CLOSE_US: Final = 2_500_000

_LOG: Final = log_of(__name__)


class NameServer:
    """Client that registers components in a CORBA name server, and keeps them registered.

    Its thread makes the calls, so that no other thread waits for the name server. All names are
    registered again every 10 s, and also as soon as the name server answers again after a failure.
    The failure and its end are logged.

    Args:
        orb: ORB of this process.
        address: address of the name server.
        renew_us: interval in us at which all names are registered again.
        look_us: retry interval in us while the name server does not answer.

    Attributes:
        answers: whether the name server accepted the names at the last attempt.
    """

    def __init__(
        self, orb: Orb, address: Endpoint, renew_us: int = _RENEW_US, look_us: int = _LOOK_US
    ) -> None:
        self._orb, self._address, self._renew_s = orb, address, renew_us / 1e6
        self._lock, self._bound = Lock(), dict[str, Reference]()
        self._gone: dict[str, Reference] = {}
        self._refused: set[str] = set()
        self.answers, self._lost_s, self._due_s = True, 0.0, 0.0
        self._thread = PeerThread(f"name server {address}", look_us)
        self._thread.submit(self._look)

    def bind(self, path: str, reference: Reference) -> None:
        """Register a name for an object in the name server, and keep it registered.

        If another object has this name, the name then refers to the new object.

        Args:
            path: path of the name, such as `robot.host_cxt/ConsoleIn0.rtc`.
            reference: CORBA reference of the object.
        """
        with self._lock:
            self._bound[path] = reference
            self._gone.pop(path, None)
        self._submit(lambda root: self._bind(root, path, reference))

    def unbind(self, path: str) -> None:
        """Remove a name, unless another object has the name by now."""
        with self._lock:
            if (reference := self._bound.pop(path, None)) is not None:
                self._gone[path] = reference
        self._submit(self._unbind_gone)

    def close(self) -> None:
        """Remove all names. A name server that does not answer keeps the names."""
        with self._lock:
            self._gone |= self._bound
            self._bound.clear()
        self._thread.submit(lambda: self._call(self._unbind_gone))
        self._thread.close(_CLOSE_US)

    def _submit(self, change: Callable[[Any], None]) -> None:
        """Change names at once. While there is no answer, `_look` changes them later."""

        def call() -> None:
            if self.answers:
                self._call(change)

        self._thread.submit(call)

    def _look(self) -> float:
        """Bind all names if that is due. The thread calls this repeatedly."""
        if not self.answers or time.monotonic() >= self._due_s:
            self._call(self._renew)
        return self._thread.retry_s

    def _call(self, change: Callable[[Any], None]) -> None:
        """Change names. If there is no answer, record this."""
        try:
            change(self._root())
        except CORBA.SystemException as error:
            self._unanswered(explain(error))
        except _NoNameServiceError as error:
            self._unanswered(str(error))

    def _root(self) -> Any:
        where = f"corbaloc::{self._address}/NameService"
        root = self._orb.reference(where)._narrow(CosNaming.NamingContext)
        if root is None:
            raise _NoNameServiceError("it is no name service")
        return root

    def _renew(self, root: Any) -> None:
        self._unbind_gone(root)
        with self._lock:
            bound = dict(self._bound)
        for path, reference in bound.items():
            self._bind(root, path, reference)
        self._due_s = time.monotonic() + self._renew_s
        if not self.answers:
            gone_s = time.monotonic() - self._lost_s
            _LOG.warning("name server %s answers again, after %.1f s", self._address, gone_s)
        self.answers = True

    def _unanswered(self, reason: str) -> None:
        if self.answers:
            text = "name server %s: %s; asked again every %g s"
            _LOG.warning(text, self._address, reason, self._thread.retry_s)
            self._lost_s = time.monotonic()
        self.answers = False

    def _bind(self, root: Any, path: str, reference: Reference) -> None:
        name = name_of(path)
        try:
            try:
                root.rebind(name, reference)
            except CosNaming.NamingContext.NotFound:
                _make_contexts(root, name[:-1])
                root.rebind(name, reference)
        except CORBA.UserException as error:
            if path not in self._refused:
                kind = type(error).__name__
                _LOG.warning("name server %s refuses %s: %s", self._address, path, kind)
            self._refused.add(path)

    def _unbind_gone(self, root: Any) -> None:
        with self._lock:
            gone = dict(self._gone)
        for path, reference in gone.items():
            name = name_of(path)
            try:
                found = root.resolve(name)
                if found is not None and found._is_equivalent(reference):
                    root.unbind(name)
            except CORBA.UserException:
                pass  # it has no such name
            with self._lock:
                self._gone.pop(path, None)


class _NoNameServiceError(Exception):
    """The server that answers is not a name service."""


def _make_contexts(root: Any, name: list[Any]) -> None:
    for depth in range(1, len(name) + 1):
        try:
            root.bind_new_context(name[:depth])
        except CosNaming.NamingContext.AlreadyBound:
            continue


def name_of(path: str) -> list[Any]:
    """Convert a path to a CORBA name, which has an ID and a kind for each part of the path.

    In each part, the kind is the text after the last dot.
    """
    parts = (part.rpartition(".") for part in path.split("/"))
    return [
        CosNaming.NameComponent(*((id_, kind) if dot else (kind, ""))) for id_, dot, kind in parts
    ]
