"""pyserial's `rfc2217://` port, with time-outs that cost nothing and errors that say more."""

from __future__ import annotations

from contextlib import suppress
from queue import Empty, Queue
from typing import Final

from serial import PortNotOpenError, SerialException, rfc2217
from serial.serialutil import Timeout

SAID_SHOWN: Final = 200

WRITE_S: Final = 1.0
"""How long a write waits for room; pyserial's own waits for 5 s."""


class Rfc2217Serial(rfc2217.Serial):
    """A serial port of another machine (RFC 2217).

    pyserial agrees with the other end on all settings when one is changed, in 50 ms at least; it
    does so even for a time-out, of which the other end knows nothing. Where the other end
    refuses in a line of text, as ser2net and ours do, it passes the line over. And it forgets
    what came before a connection ended.

    Args and attributes are those of `serial.Serial`; `write_timeout` cannot be set.
    """

    _agreed: object = None

    def open(self) -> None:
        """Open the port.

        Raises:
            SerialException: nobody listens there, or nobody who knows RFC 2217; the text
                has what was said instead.
        """
        self._agreed = None
        try:
            super().open()
        except OSError as error:
            if (queue := self._queue) is None:  # there was no connection
                raise
            received = b"".join(queue.get() or b"" for _ in range(queue.qsize()))
            said = received.decode("ascii", "replace").strip()
            instead = f"it said {said[:SAID_SHOWN]!r}" if said else "it said nothing"
            raise SerialException(f"no serial server answers there: {instead}") from error
        self._socket.settimeout(WRITE_S)  # type: ignore[attr-defined] # not in typeshed

    def close(self) -> None:
        """Close the port, and its connection even if the other end has reset it."""
        connection = self._socket  # type: ignore[attr-defined] # not in typeshed
        super().close()
        if connection is not None:
            connection.close()

    def read(self, size: int = 1) -> bytes:
        """Return up to `size` bytes, fewer if the time-out is over or the connection has ended.

        Raises:
            SerialException: it has ended, and all that came was read.
        """
        if not self.is_open or (queue := self._queue) is None:
            raise PortNotOpenError
        received = bytearray()
        timeout = Timeout(self.timeout)  # type: ignore[arg-type] # None is for ever
        with suppress(Empty):
            while len(received) < size:
                if (piece := queue.get(timeout=timeout.time_left())) is None:
                    queue.put(None)  # the next look finds the end too
                    if received:
                        break
                    raise SerialException("the connection has ended")
                received += piece
        return bytes(received)

    def _telnet_read_loop(self) -> None:
        """Take what comes, in a thread; what is no telnet ends it, as the end of the line does."""
        try:
            with suppress(TypeError, OSError):
                super()._telnet_read_loop()  # type: ignore[misc] # not in typeshed
        finally:
            if (queue := self._queue) is not None:
                queue.put(None)

    @property
    def _queue(self) -> Queue[bytes | None] | None:
        """What its reading thread has received, None if there was no connection yet."""
        queue: Queue[bytes | None] | None = self._read_buffer  # type: ignore[attr-defined]
        return queue

    def _reconfigure_port(self) -> None:
        framing = (self.baudrate, self.bytesize, self.parity, self.stopbits)
        settings = (*framing, self.xonxoff, self.rtscts, self.dsrdtr, self.write_timeout)
        if settings != self._agreed:
            super()._reconfigure_port()  # type: ignore[misc] # not in typeshed
            self._agreed = settings
