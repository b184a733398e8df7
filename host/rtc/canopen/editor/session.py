"""A server that runs in a thread while a user interface displays it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Final

from tickrig.host.links.link import StampedLink
from tickrig.host.rtc.canopen.definition_writer import save_definition
from tickrig.host.rtc.canopen.events import EventListener
from tickrig.host.rtc.canopen.serve import open_server
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.canopen.view import ServerView
from tickrig.wire.can import ErrorState, Frames

_LONGEST_US: Final = 10_000
"""Longest time until a request is executed."""

AddComponents = Callable[[RtcCanopenServer], None]
"""Function that adds other components to a server."""


class EditorSession:
    """Runs a CANopen server in a thread while a user interface shows it.

    The session can load another System Definition, and then makes a new server for it. Hold `lock`
    while you access the server.

    Args:
        server: server to run.
        path: path of the System Definition.
        link: connection to the bus.
        add_components: function that adds components to each loaded server.
        listeners: functions that are called with the events of each server.

    Attributes:
        lock: lock that protects the server.
        path: file from which the System Definition was last read, or to which it was saved.
        server: server that runs at present.
    """

    def __init__(
        self,
        server: RtcCanopenServer,
        path: Path,
        link: StampedLink,
        add_components: AddComponents = lambda server: None,
        listeners: tuple[EventListener, ...] = (),
    ) -> None:
        self.lock, self.path, self._folder = threading.RLock(), path, path.parent
        self._link, self._add_components, self._listeners = link, add_components, listeners
        self._leaving: Frames = ()
        self._stop, self._pool = threading.Event(), ThreadPoolExecutor(1, "server")
        self._thread: Future[None] | None = None
        self.server = server
        server.log.listeners += listeners

    @property
    def view(self) -> ServerView:
        """A view of the server, to read its state and to send it commands."""
        return ServerView(self.server)

    @property
    def ended(self) -> bool:
        """Whether an error ended the thread."""
        return self._thread is not None and self._thread.done()

    @property
    def eds_paths(self) -> dict[int, Path]:
        """The EDS of each node by node-ID."""
        nodes = self.server.definition.nodes
        return {node.id: self._folder / node.eds for node in nodes}

    def load(self, path: Path) -> None:
        """Change to the System Definition in another file, for which a new server is made.

        The old server ends. It leaves its nodes in the NMT state that its definition requires.

        Raises:
            DefinitionError: the definition or an EDS cannot be used.
            OSError: the definition cannot be read.
        """
        server = open_server(path)
        self._add_components(server)
        server.log.listeners += self._listeners
        with self.lock:
            self._leaving += self.server.stop(self.server.now_us)
            self.server, self.path, self._folder = server, path, path.parent

    def save(self, path: Path) -> None:
        """Save the definition with the present connections and links.

        Raise OSError if that fails.
        """
        with self.lock:
            definition = self.view.definition()
        save_definition(definition, self._folder, path)
        self.path = path

    def bus_state(self, state: ErrorState, /) -> None:
        """Forward a report of the CAN controller to the server."""
        self.server.bus_state(state)

    def turn(self, until_us: int) -> None:
        """Wait until the server has work to do, then tick the server and send its frames.

        Args:
            until_us: time in us at which the wait ends at the latest.
        """
        link = self._link
        due_us = min(self.server.due_us, until_us)
        now_us, received = link.receive_stamped(max(0, due_us - link.now_us))
        with self.lock:
            sent = (*self._leaving, *self.server.tick(now_us, received))
            self._leaving = ()
        if sent:
            link.send(sent)

    def start(self) -> None:
        """Start the thread."""
        self._thread = self._pool.submit(self._run)

    def close(self) -> None:
        """End the thread, and leave the nodes. Raise LinkClosed if the bus is gone."""
        self._stop.set()
        self._pool.shutdown()
        if self._thread is not None:
            self._thread.result()
        self._link.send((*self._leaving, *self.server.stop(self._link.now_us)))

    def _run(self) -> None:
        while not self._stop.is_set():
            self.turn(self._link.now_us + _LONGEST_US)
