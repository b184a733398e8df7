"""A link that writes what passes it into a trace (docs/reference/bench/trace.md)."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any, Final, Generic

from tickrig.host.links.link import Link, StampedFrames, StampedLink, W
from tickrig.host.text.bench_header import BenchHeader, DeviceEntry, Place, WireEntry, WireType
from tickrig.host.text.bench_record import BenchRecord, change_text
from tickrig.host.text.trace import RESET, Mark
from tickrig.host.text.values import Setting
from tickrig.host.text.whole_file import LineFile
from tickrig.wire.can import CanFrame

_WIRE: Final = "wire"
"""What the only wire is called."""


class RecordingLink(Generic[W]):
    """A `Link` whose traffic, both ways, is recorded in a trace, for `tickrig compare`.

    Each line is written at once, so that a kill loses nothing; where writing fails the
    recording ends with one warning, and the link goes on. Two threads may use it, one of them
    to send.

    Args:
        link: the link behind it, to bytes or to frames.
        path: the file; one that exists is replaced.
        name: what the device is called in it; of frames, the bus.
        type: device type, such as `rrc`, if it is known.

    Raises:
        OSError: the file cannot be opened.
        ValueError: the name cannot stand in a trace.
    """

    def __init__(
        self,
        link: Link[W],
        path: Path | str,
        *,
        name: str = "device",
        type: str = "",  # noqa: A002 - as rig files and headers have it
    ) -> None:
        on_can = hasattr(link, "receive_stamped")
        wire = WireEntry(WireType.CAN if on_can else WireType.SERIAL)
        header = BenchHeader({name: DeviceEntry(_WIRE, type)}, {_WIRE: wire}, place=Place.PORT)
        self._link, self._name = link, name
        self._file = LineFile(Path(path), header.encode(), "the link")
        self._lock, self._start_us, self._latest_us = threading.Lock(), link.now_us, 0

    @property
    def now_us(self) -> int:
        """Time on the clock of the link behind it."""
        return self._link.now_us

    @property
    def recording_error(self) -> str:
        """Why the recording ended early, empty while all is well."""
        return self._file.error

    def send(self, traffic: W, /) -> None:
        """Send, and record it.

        Args:
            traffic: bytes or frames.

        Raises:
            LinkClosed: the line is gone; what did not leave is not recorded.
        """
        at_us = self._link.now_us
        self._link.send(traffic)
        self._record(Mark.TO_DEVICE, [(at_us, item) for item in _items(traffic)])

    def receive(self, timeout_us: int, /) -> W:
        """Receive, and record it.

        Args:
            timeout_us: how long to wait; 0 only looks.

        Returns:
            What arrived, empty if nothing came in time.

        Raises:
            LinkClosed: the line is gone.
        """
        traffic = self._link.receive(timeout_us)
        at_us = self._link.now_us
        self._record(Mark.FROM_DEVICE, [(at_us, item) for item in _items(traffic)])
        return traffic

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Receive frames with their times, and record them.

        Args:
            timeout_us: how long to wait; 0 only looks.

        Returns:
            A time, and the frames that had arrived by then, each with its own time.

        Raises:
            LinkClosed: the bus is gone.
            TypeError: the link behind it is not to a bus.
        """
        link: Any = self._link
        if not hasattr(link, "receive_stamped"):
            raise TypeError("this link carries bytes")
        bus: StampedLink = link
        now_us, stamped = bus.receive_stamped(timeout_us)
        self._record(Mark.FROM_DEVICE, stamped)
        return now_us, stamped

    def note(self, name: str, value: Setting) -> None:
        """Record what somebody did to the device by hand.

        Args:
            name: of the physical input, as `power_button`.
            value: what it is now.
        """
        self._write(self._link.now_us, Mark.PHYSICAL, text=change_text(name, value))

    def note_reset(self) -> None:
        """Record that the device was switched off and on."""
        self._write(self._link.now_us, Mark.PHYSICAL, text=RESET)

    def close(self) -> None:
        """Write how long the recording lasted, and close the link; closing twice is no error."""
        with self._lock:
            end_us = max(self._link.now_us - self._start_us, self._latest_us)
            self._file.close(BenchRecord(end_us, "", Mark.END).encode())
        self._link.close()

    def _record(
        self, mark: Mark, items: list[tuple[int, bytes | CanFrame]] | StampedFrames
    ) -> None:
        for at_us, traffic in items:
            self._write(at_us, mark, traffic)

    def _write(
        self, at_us: int, mark: Mark, traffic: bytes | CanFrame = b"", text: str = ""
    ) -> None:
        """Write a line; one that comes late, by the other way or thread, is not before its last."""
        with self._lock:
            self._latest_us = max(self._latest_us, at_us - self._start_us)
            record = BenchRecord(self._latest_us, self._name, mark, traffic, text)
            self._file.write([record.encode()])


def _items(traffic: object) -> list[bytes | CanFrame]:
    """Return what of traffic is a line of a trace each: all bytes, or a frame."""
    if isinstance(traffic, bytes):
        return [traffic] if traffic else []
    assert isinstance(traffic, tuple)
    return list(traffic)
