"""A pyserial port on a rig: opened and closed, its settings, its modem lines."""

from __future__ import annotations

import copyreg
import io
import logging
import warnings
from typing import Any, NoReturn, cast

from serial.serialutil import XOFF, XON, PortNotOpenError, SerialBase, SerialException

from tickrig.device.twin import twin
from tickrig.emulators.serial.outside.host_waits import NO_ASYNCIO
from tickrig.emulators.serial.outside.modem_lines import ModemLines
from tickrig.emulators.serial.outside.serial_side import Mismatch, SerialSide
from tickrig.wire.serial.uart import Parity, UartSetting

LOG = logging.getLogger(__name__)


class SimPort(SerialBase):
    """A port without its bytes: those are `SimSerial`'s.

    Attributes:
        side: the host's side of the line, once it is known.
        mismatch: what a setting is that is not the device's; None as `side` has it.
    """

    side: SerialSide | None = None
    mismatch: Mismatch | None = None
    is_open = False

    def _begin(self, *positional: Any, **options: Any) -> None:
        """Take settings, as a port that is not open."""
        self._input = bytearray()
        super().__init__(None, *positional, **options)

    def __reduce_ex__(self, protocol: object, /) -> tuple[Any, ...]:
        """Copy it with its rig; `rig.fork(port)` does so."""
        return copyreg.__newobj__, (type(self),), vars(self)  # type: ignore[attr-defined]

    def __deepcopy__(self, memo: dict[int, Any]) -> SimPort:
        """Return a port on a twin of the rig."""
        return twin(self, memo)

    def open(self) -> None:
        """Open the port: DTR and RTS go on, and what came before is forgotten.

        Raises:
            SerialException: it is open, or another one is at the same line, or its setting is
                refused.
        """
        if self.is_open:
            raise SerialException("Port is already open.")
        if self.port is None or self.side is None:
            raise SerialException("Port must be configured before it can be used.")
        side = self.side
        side.waits.check_thread(self.port)
        if side.in_use:
            raise SerialException(f"could not open port {self.port}: another host has it open")
        self.is_open = True
        try:
            self._reconfigure_port()
        except (ValueError, SerialException):
            self.is_open = False
            raise
        side.in_use, lines = True, side.modem_lines
        lines.dtr, lines.rts = bool(self.dsrdtr or self.dtr), bool(self.rtscts or self.rts)
        self.reset_input_buffer()

    def close(self) -> None:
        """Close the port; DTR and RTS go off, a break ends, and what was sent still arrives."""
        if not self.is_open or self.side is None:
            return
        self.is_open = self.side.in_use = False
        self.side.modem_lines.dtr = self.side.modem_lines.rts = False
        self.side.transmitter.held.clear()
        self.side.transmitter.suspended = False
        if self.break_condition:
            self.side.transmitter.set_break(self.side.rig.now_us, on=False)

    def reset_input_buffer(self) -> None:
        """Forget what has come and was not read."""
        side = self._side()
        side.receiver.poll(side.rig.now_us)
        self._input.clear()

    def _side(self) -> SerialSide:
        """Return the line; raise SerialException if it cannot be used."""
        if not self.is_open or self.side is None:
            raise PortNotOpenError
        self.side.waits.check_thread(str(self.port))
        return self.side

    def _reconfigure_port(self) -> None:
        """Use the settings, which pyserial has put into its properties."""
        side = self._side()
        if self.baudrate == 0:
            raise ValueError("Invalid baud rate: 0")
        parity = cast(Parity, self.parity)  # pyserial has checked it
        setting = UartSetting(self.baudrate, self.bytesize, parity, self.stopbits)
        if setting != side.setting or not side.in_use:
            self._input += side.receiver.poll(side.rig.now_us)
            self._use(side, setting)
        side.transmitter.waits_for_cts = bool(self.rtscts)
        side.transmitter.release(side.rig.now_us)

    def _use(self, side: SerialSide, setting: UartSetting) -> None:
        """Send and receive at a setting; raise SerialException if it is refused."""
        if side.device is not None:
            if setting != side.device:
                what = f"{self.port} is set to {setting}, the device has {side.device}"
                if (self.mismatch or side.mismatch) == "refuse":
                    raise SerialException(what)
                LOG.warning("%s: each samples what the other sends, perhaps wrongly", what)
            side.transmitter.setting = setting
            side.receiver.use(setting, side.rig.now_us)
        side.setting = setting

    def _update_dtr_state(self) -> None:
        self._side().modem_lines.dtr = bool(self.dtr)

    def _update_rts_state(self) -> None:
        self._side().modem_lines.rts = bool(self.rts)

    @property
    def cts(self) -> bool:
        """Clear To Send."""
        return self._modem_lines().cts

    @property
    def dsr(self) -> bool:
        """Data Set Ready."""
        return self._modem_lines().dsr

    @property
    def ri(self) -> bool:
        """Ring Indicator."""
        return self._modem_lines().ri

    @property
    def cd(self) -> bool:
        """Carrier Detect."""
        return self._modem_lines().cd

    def _modem_lines(self) -> ModemLines:
        side = self._side()
        side.waits.look()
        return side.modem_lines

    def set_output_flow_control(self, enable: bool = True) -> None:
        """Suspend or resume the output; what is written meanwhile is held.

        Args:
            enable: whether to send.
        """
        side = self._side()
        side.transmitter.suspended = not enable
        side.transmitter.release(side.rig.now_us)

    def set_input_flow_control(self, enable: bool = True) -> None:
        """Send XON or XOFF to the device.

        Args:
            enable: XON if true, else XOFF.
        """
        side = self._side()
        side.transmitter.send(side.rig.now_us, XON if enable else XOFF)

    def nonblocking(self) -> None:
        """Warn and change nothing, as the ports of pyserial do."""
        warnings.warn("nonblocking() has no effect", DeprecationWarning, stacklevel=2)

    def set_low_latency_mode(self, low_latency_settings: bool) -> None:
        """Change nothing: a byte is there when its stop bit has passed.

        Args:
            low_latency_settings: as pyserial takes it.
        """
        self._side()

    def fileno(self) -> NoReturn:
        """Refuse: there is nothing that `select` could wait for."""
        raise io.UnsupportedOperation(f"{self.port}: {NO_ASYNCIO}")
