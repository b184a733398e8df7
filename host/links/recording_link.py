"""A link that records its traffic in a trace (docs/reference/bench/trace.md)."""

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
"""Name of the only wire."""


class RecordingLink(Generic[W]):
    """A `Link` that records its traffic in both directions in a trace, for `tickrig compare`.

    Each line is written at once, so that no line is lost if the process is killed. If writing
    fails, the recording ends with one warning, and the link continues. Two threads may use the link
    at the same time, if only one of them sends.

    Args:
        link: link to record, which carries bytes or frames.
        path: path of the file. An existing file is replaced.
        name: name of the device in the trace, or for frames the name of the bus.
        type: device type such as `rrc`, empty if unknown.

    Raises:
        OSError: the file cannot be opened.
        ValueError: the name is not valid in a trace.
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
        """Time on the clock of the link."""
        return self._link.now_us

    @property
    def recording_error(self) -> str:
        """Reason for the early end of the recording, empty if there was no error."""
        return self._file.error

    def send(self, traffic: W, /) -> None:
        """Send traffic over the link, and record it in the trace.

        Args:
            traffic: bytes or CAN frames.

        Raises:
            LinkClosed: the connection is lost. The traffic that was not sent is not recorded.
        """
        at_us = self._link.now_us
        self._link.send(traffic)
        self._record(Mark.TO_DEVICE, [(at_us, item) for item in _items(traffic)])

    def receive(self, timeout_us: int, /) -> W:
        """Receive traffic from the link, and record it in the trace.

        Args:
            timeout_us: longest wait in microseconds. 0 does not wait.

        Returns:
            The received traffic, empty after the timeout.

        Raises:
            LinkClosed: the connection is lost.
        """
        traffic = self._link.receive(timeout_us)
        at_us = self._link.now_us
        self._record(Mark.FROM_DEVICE, [(at_us, item) for item in _items(traffic)])
        return traffic

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Receive CAN frames with their arrival times, and record them in the trace.

        Args:
            timeout_us: longest wait in microseconds. 0 does not wait.

        Returns:
            A time, and the frames that had arrived by then, each with its arrival time.

        Raises:
            LinkClosed: the connection to the bus is lost.
            TypeError: the link carries bytes, not CAN frames.
        """
        link: Any = self._link
        if not hasattr(link, "receive_stamped"):
            raise TypeError("this link carries bytes")
        bus: StampedLink = link
        now_us, stamped = bus.receive_stamped(timeout_us)
        self._record(Mark.FROM_DEVICE, stamped)
        return now_us, stamped

    def note(self, name: str, value: Setting) -> None:
        """Record that a user operated the device by hand, for example pressed a button.

        Args:
            name: name of the operated input, such as `power_button`.
            value: new value of the input.
        """
        self._write(self._link.now_us, Mark.PHYSICAL, text=change_text(name, value))

    def note_reset(self) -> None:
        """Record that the device was switched off and on."""
        self._write(self._link.now_us, Mark.PHYSICAL, text=RESET)

    def close(self) -> None:
        """Complete the trace with the duration of the recording, and close the link.

        You may call this method again.
        """
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
        """Write a line. The time of a line is never before the time of the previous line."""
        with self._lock:
            self._latest_us = max(self._latest_us, at_us - self._start_us)
            record = BenchRecord(self._latest_us, self._name, mark, traffic, text)
            self._file.write([record.encode()])


def _items(traffic: object) -> list[bytes | CanFrame]:
    """Return traffic split into lines of a trace, which are all bytes, or one frame each."""
    if isinstance(traffic, bytes):
        return [traffic] if traffic else []
    assert isinstance(traffic, tuple)
    return list(traffic)
