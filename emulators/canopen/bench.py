"""Nodes on a bus with all around them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.outside.without_echo import CountingPort
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.body.body_spec import BodySpec
from tickrig.emulators.canopen.node.node import Node
from tickrig.emulators.canopen.node.nodes import Nodes
from tickrig.emulators.canopen.node.store_file import StoreFile
from tickrig.emulators.record.candump_file import CandumpFile
from tickrig.emulators.rig.clock import Clock
from tickrig.emulators.rig.rig import Station
from tickrig.host.text.log import log_of

NAME: Final = "canopen-slave"

_logger = log_of(__name__)


def make_bench(  # noqa: PLR0913 - options, by keyword
    wire: CanWire,
    nodes: Sequence[Node],
    body: BodySpec | None = None,
    *,
    outside: CountingPort | None = None,
    link: str = "",
    trace: CandumpFile | None = None,
    clock: Clock | None = None,
) -> CanEmulator:
    """Put nodes together with a body, the bus outside, if there are such, and a clock."""
    bodies = [body.put_on(nodes)] if body else []
    stations = [Station(node, node.port) for node in nodes]
    return CanEmulator(
        NAME,
        Nodes(nodes, bodies),
        stations,
        wire,
        couplings=bodies,
        outside=outside,
        clock=clock,
        trace=trace,
        link=link,
    )


def store_keeper(store: StoreFile) -> Callable[[int], None]:
    """Return what writes the file whenever a node has stored something.

    Where writing fails there is one warning, and it is tried again.
    """
    failed = False

    def keep(now_us: int) -> None:
        nonlocal failed
        try:
            store.save()
            failed = False
        except OSError as error:
            if not failed:
                _logger.warning("store %s: %s; the emulator goes on", store.path, error.strerror)
            failed = True

    return keep
