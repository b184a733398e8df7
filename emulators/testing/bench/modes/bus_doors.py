"""Connections to a CAN bus: a monitored python-can bus, a link, a bridge.

This module imports python-can, which takes longer than the rest of a bench. A bench without an
outside bus does not load this module.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from time import monotonic_ns
from typing import Any

import can

from tickrig.emulators.can.outside.bridge import CanBridge
from tickrig.emulators.can.outside.bus_port import port_on
from tickrig.emulators.canopen.node import SecondNodeAlarm
from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.emulators.testing.bench.modes.door_watch import HostPace, LinkGone, Seen
from tickrig.emulators.testing.bench.mounts import BusMount
from tickrig.emulators.testing.rig_file.plan import BusPlan
from tickrig.host.links import can_link
from tickrig.host.links.echo import free_of_echo
from tickrig.host.links.link import StampedLink, first_line
from tickrig.host.text.trace import Mark
from tickrig.wire.can import Frames


class BusGone(PortGone, can.CanOperationError):
    """A bus is gone; hosts can catch it as an error of python-can."""


class _Watched(can.BusABC):
    """Monitoring added to a bus class."""

    _watch: HostPace
    _reads: can_link.BusReceiver

    def recv(self, timeout: float | None = None) -> can.Message | None:
        self._watch.used()
        begun_ns = monotonic_ns()
        with self._told_if_gone():
            message = self._reads.receive(timeout)
            while message is None and timeout is None:
                message = self._reads.receive(timeout)
        if message is not None:
            error = can_link.to_error_frame(message)
            self._pass_on(Mark.FROM_DEVICE, _frames_of(message) if error is None else (error,))
        elif timeout is not None:
            self._watch.waited(round(timeout * 1e6), (monotonic_ns() - begun_ns) // 1_000)
        return message

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._watch.used()
        with self._watch.sending(_frames_of(msg)), self._told_if_gone():
            super().send(msg, timeout)  # type: ignore[safe-super]  # of the class that is watched
        self._pass_on(Mark.TO_DEVICE, _frames_of(msg))

    @contextmanager
    def _told_if_gone(self) -> Iterator[None]:
        try:
            yield
        except (can.CanOperationError, OSError) as error:
            code = error.error_code if isinstance(error, can.CanError) else error.errno
            if code not in can_link.GONE:
                raise
            raise BusGone(f"{self.channel_info}: {first_line(error)}", code) from error

    def _pass_on(self, mark: Mark, frames: Seen) -> None:
        if frames:
            self._watch.passed(mark, frames)


def _frames_of(message: can.Message) -> Frames:
    frame = can_link.to_frame(message)
    return (frame,) if frame else ()


def _open_bus(plan: BusPlan, options: dict[str, Any]) -> can.BusABC:
    """Open a bus.

    Args:
        plan: address and options of the bus.
        options: further options of `can.Bus`.

    Raises:
        BusGone: the bus cannot be opened.
    """
    rate = {} if plan.bit_rate is None else {"bitrate": plan.bit_rate}
    try:
        bus = can.Bus(plan.channel, plan.interface, **{**rate, **dict(plan.options), **options})
    except (can.CanError, OSError, ValueError, ImportError, AttributeError) as error:
        raise BusGone(f"cannot open {_name_of(plan)}: {can_link.bus_reason(error)}") from None
    can_link.prepare_bus(bus, plan.interface)
    return bus


def open_watched_bus(plan: BusPlan, watch: HostPace, options: dict[str, Any]) -> can.BusABC:
    """Open a monitored bus; see `_open_bus`."""
    bus = _open_bus(plan, options)
    kind = type(bus)
    reads = can_link.BusReceiver(
        bus,
        _name_of(plan),
        gone=BusGone,
        raises=(can.CanError, OSError),
        read=partial(kind.recv, bus),
    )
    bus.__class__ = type(kind.__name__, (_Watched, kind), {"_watch": watch, "_reads": reads})
    return bus


def _name_of(plan: BusPlan) -> str:
    """Return the name of a bus, such as `socketcan can0`."""
    return plan.interface if plan.channel is None else f"{plan.interface} {plan.channel}"


def frame_link(plan: BusPlan, watch: HostPace) -> StampedLink:
    """Return a link of a host to a python-can bus. The link does not receive its own frames.

    Raises:
        BusGone: the bus cannot be opened.
    """
    link = can_link.CanLink(_open_bus(plan, {}), _name_of(plan))
    link.on_error_frame = lambda frame: watch.passed(Mark.FROM_DEVICE, (frame,))
    return free_of_echo(link, plan.interface)


def join_bus(mount: BusMount, plan: BusPlan, stack: ExitStack) -> CanBridge:
    """Connect an emulated CAN bus with a python-can bus, and return the bridge between them.

    Args:
        mount: emulated bus, with its nodes.
        plan: settings of the python-can bus.
        stack: exit stack that closes the python-can bus at the end.

    Raises:
        BusGone: the python-can bus cannot be opened.
    """
    bus = _open_bus(plan, {})
    stack.callback(can_link.close_bus, bus)
    port = port_on(bus, plan.interface, _name_of(plan), LinkGone)
    return CanBridge(mount.open_end(), SecondNodeAlarm(port, tuple(mount.nodes.values())))
