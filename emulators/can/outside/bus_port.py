"""Any bus of python-can as a port of a rig in real time."""

from __future__ import annotations

from collections import deque
from contextlib import ExitStack
from typing import Final, NamedTuple

import can

from tickrig.device.twin import NonCopyable
from tickrig.emulators.can.outside.bridge import CountingPort, WithoutEcho
from tickrig.host.cli.can_options import BusOptions, open_raw
from tickrig.host.links.can_link import receive
from tickrig.host.links.can_message import to_frame, to_message
from tickrig.host.links.echo import ECHOING
from tickrig.host.text.log import log_of
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

FRAMES_A_POLL: Final = 1_024
"""So that a bus that never falls silent cannot stop the clock."""

_logger = log_of(__name__)


class CanBusPort(NonCopyable):
    """A `Port[Frames]` on a real or virtual bus; it never waits.

    What the adapter does not take at once is kept up to `queue_frames`, and
    sent in order; after that frames are dropped and counted.

    Args:
        bus: an open bus. Nobody else may read from it.
        queue_frames: frames kept for an adapter that takes none.

    Attributes:
        lost: frames dropped because the adapter took none.
        errors: error frames that came in.
        failed: why the adapter last took or gave nothing, empty while all is well.
    """

    why_not_copied = "it is a bus of this machine"

    def __init__(self, bus: can.BusABC, queue_frames: int = 4_096) -> None:
        self._bus, self._queue_frames = bus, queue_frames
        self._unsent: deque[CanFrame] = deque()
        self.lost = self.errors = 0
        self.failed = ""

    @property
    def due_us(self) -> int:
        """Unknown to anybody but the bus."""
        return NEVER

    def poll(self, now_us: int, /) -> Frames:
        """Read without waiting."""
        self._flush()
        frames = []
        for _ in range(FRAMES_A_POLL):
            message = self._read()
            if message is None:
                break
            frame = to_frame(message)
            if frame is None:
                self.errors += message.is_error_frame
            else:
                frames.append(frame)
        return tuple(frames)

    def send(self, now_us: int, traffic: Frames, /) -> None:
        """Send as much as the adapter takes; keep the rest for later."""
        room = self._queue_frames - len(self._unsent)
        self.lost += max(0, len(traffic) - room)
        self._unsent += traffic[:room]
        self._flush()

    def close(self) -> None:
        """Close the bus."""
        self._bus.shutdown()

    def _read(self) -> can.Message | None:
        try:
            return receive(self._bus.recv, 0)
        except (can.CanError, OSError) as error:
            self._note(str(error))
            return None

    def _flush(self) -> None:
        try:
            while self._unsent:
                self._bus.send(to_message(self._unsent[0]), timeout=0)
                self._unsent.popleft()
            self._note("")
        except (can.CanError, OSError) as error:
            self._note(str(error))

    def _note(self, failed: str) -> None:
        """Warn once, not in every tick."""
        if failed and not self.failed:
            _logger.warning("CAN bus: %s; what it does not take is kept", failed)
        self.failed = failed


class OpenBus(NamedTuple):
    """A bus outside.

    Attributes:
        port: the bus.
        name: what people call it.
        channel: what logs call it.
    """

    port: CountingPort
    name: str
    channel: str


def open_bus(options: BusOptions, stack: ExitStack) -> OpenBus:
    """Open the bus that options, environment or configuration files of python-can name.

    Raises:
        Refused: none is named, or it cannot be opened.
    """
    instead = "give --scenario FILE, which runs in virtual time"
    bus, interface, channel = open_raw(options, instead)
    stack.callback(bus.shutdown)
    name = interface if channel is None else f"{interface} {channel}"
    label = "_".join(str(channel).split()) if channel not in (None, "") else interface
    return OpenBus(port_on(bus, interface), name, label)


def port_on(bus: can.BusABC, interface: str) -> CountingPort:
    """Return the port on an open bus, without the echo that some interfaces give."""
    port = CanBusPort(bus)
    return WithoutEcho(port) if interface in ECHOING else port
