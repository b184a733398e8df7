"""Running a server on a link, which is a rig in virtual time, or a real bus."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tickrig.host.links.link import StampedLink
from tickrig.host.rtc.canopen.definition import (
    DefinitionError,
    DeviceFile,
    SystemDefinition,
    read_device_file,
)
from tickrig.host.rtc.canopen.definition_reader import read_definition
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.system.schedule import LATE_US, PAUSE_US
from tickrig.wire.instant import NEVER


def serve(
    server: RtcCanopenServer,
    link: StampedLink,
    until_us: int = NEVER,
    done: Callable[[], bool] = lambda: False,
) -> None:
    """Run a CANopen server on a bus until a time on the link's clock, or until `done()` is true.

    Args:
        server: server to run.
        link: connection to the bus.
        until_us: time in us at which the run ends.
        done: function that is called before each tick.

    Raises:
        LinkClosed: the bus is closed.
    """
    while link.now_us < until_us and not done():
        _step(server, link, until_us)


class ServerRunner:
    """Runs a CANopen server on a bus until `stop` is called, and serves clients in between.

    Args:
        server: server to run.
        link: connection to the bus.

    Attributes:
        running: whether the server runs. It is False once `stop` was called.
        late_ticks: number of ticks that began more than 1 ms late.
        worst_late_us: largest delay of a tick in us.
        after_tick: functions that are called with the time in us after each tick.
        serve: function that is called between the ticks, at least every `pause_us`, with the time
            in us that it may take. It can serve a control socket, for example.
        pause_us: longest time in us that a served client waits, 20 ms by default.
    """

    def __init__(self, server: RtcCanopenServer, link: StampedLink) -> None:
        self._server, self._link = server, link
        self.running, self.late_ticks, self.worst_late_us = True, 0, 0
        self.after_tick: list[Callable[[int], None]] = []
        self.serve: Callable[[int], None] | None = None
        self.pause_us = PAUSE_US

    def run(self, until_us: int = NEVER) -> None:
        """Run the server until a time on the link's clock, or until `stop` is called.

        Args:
            until_us: time in us at which the run ends. By default, it has no end.

        Raises:
            LinkClosed: the bus is gone.
        """
        while self.running and self._link.now_us < until_us:
            pause_us = until_us
            if self.serve is not None:
                self.serve(0)
                pause_us = min(until_us, self._link.now_us + self.pause_us)
            late_us = _step(self._server, self._link, pause_us)
            self.worst_late_us = max(self.worst_late_us, late_us)
            self.late_ticks += late_us > LATE_US
            for listener in tuple(self.after_tick):
                listener(self._server.now_us)

    def stop(self) -> None:
        """End `run` after the present tick."""
        self.running = False


def _step(server: RtcCanopenServer, link: StampedLink, until_us: int) -> int:
    """Wait for frames or the next due time, tick the server, and send. Return the delay in us."""
    due_us = min(server.due_us, until_us)
    now_us, received = link.receive_stamped(max(0, due_us - link.now_us))
    if sent := server.tick(now_us, received):
        link.send(sent)
    return max(0, now_us - due_us) if due_us else 0


def open_server(path: Path) -> RtcCanopenServer:
    """Create a CANopen server from the file of a System Definition and the EDS files that it names.

    Raises:
        OSError: the definition cannot be read.
        DefinitionError: the definition or an EDS cannot be used. The error has the line and the
            reason.
    """
    definition = read_definition(path)
    return RtcCanopenServer(definition, read_files(definition, path.parent))


def read_files(definition: SystemDefinition, folder: Path) -> dict[str, DeviceFile]:
    """Read the EDS files that a System Definition names. Return them by the path in the definition.

    Each file is read once.

    Args:
        definition: System Definition.
        folder: folder to which the paths of the EDS files are relative.

    Raises:
        DefinitionError: a file cannot be used, or lacks a PDO that the definition names.
    """
    names = dict.fromkeys(node.eds for node in definition.nodes)
    files = {name: read_device_file(folder / name) for name in names}
    by_id = {node.id: files[node.eds] for node in definition.nodes}
    for pdo in definition.named_pdos:
        if pdo.index not in by_id[pdo.node].pdos:
            raise DefinitionError(f"{pdo}: the EDS of node {pdo.node} has no {pdo.index:04X}h")
    return files
