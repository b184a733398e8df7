"""RefHardRh3, which converts the cart's velocity into wheel speeds on an RS485 line."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from math import tau
from typing import ClassVar, Final, Protocol

from tickrig.host.links.link import Link, LinkError
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import (
    ExecutionContext,
    InPort,
    ModuleSpec,
    OutPort,
    Provider,
    ReturnCode,
    RtComponent,
    ServicePort,
)
from tickrig.host.rtc.configuration import Parameter
from tickrig.host.rtc.motion.geometry import Twist, wheel_speeds
from tickrig.host.rtc.motion.modbus_master import ModbusAnswer, ModbusMaster
from tickrig.host.rtc.motion.ports import plausible, read_newest
from tickrig.host.text.log import log_of
from tickrig.wire import modbus
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Time, TimedDoubleSeq

_MAX_MISSES: Final = 5
"""Number of successive unanswered or refused requests that bring the component to Error.

rh3-control proposes 3. If a fifth of all exchanges is lost, this happens once in ten minutes.
"""

_GAINS: Final[Mapping[str, int]] = {"P": 10, "I": 0, "D": 0, "VP": 10, "VI": 0, "VD": 1}
"""Gains of the position and the velocity loop."""

_WATCHDOG_MS: Final = 500
"""Silence after which the base stops by itself."""

_TURN: Final = 2**32  # counts after which a counter begins again

_IDENTITY: Final = modbus.Request(modbus.READ, (modbus.Address.DEVICE_ID, 1))

_MODE: Final = modbus.Request(modbus.READ, (modbus.Address.MODE, 1))

_LOG: Final = log_of(__name__)

Opener = Callable[[str], Link[bytes]]
"""Function that opens the line that DeviceFileName names."""


class RefHard(Protocol):
    """The service of RefHardRh3Pro.idl."""

    def Stop(self) -> None:  # noqa: N802 - as in the IDL
        """Stop a running cart."""

    def Go(self) -> None:  # noqa: N802
        """Make a stopped cart run."""


class RefHardRh3(RtComponent):
    """A component that exchanges data with the base once a period.

    The component sends speeds and receives angles.

    In on_execute, the component reads the answer of the previous period and writes the wheel
    angles. In on_state_update, after all components have executed, it sends the speeds of this
    period. Therefore it does not wait, and a command is on the line in the period in which it was
    made.

    The component goes to Error in these cases. The base then stops by its own watchdog:

    - the base has a fault
    - the base refuses, or does not answer, `_MAX_MISSES` requests in a row
    - the line is closed

    While the bumper is pressed, and after `Stop`, the component commands standstill. If a wheel
    would be faster than Velocity_limit, both wheels are slowed down by the same factor.

    First, the component requests the identification of the device. It writes nothing before the
    device has answered as a base does. With `AnyDevice` set to 1, it does not request the
    identification.

    Not emulated: the library libsvm and its protocol, whose texts are not public.

    Args:
        instance_name: name of the component.
        open_link: function that opens the line. By default, it is opened by pyserial.

    Attributes:
        report: latest report of the base.
        error_reason: reason of the latest Error.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("RefHardRh3", "Base of Reference Hardware 3")

    def __init__(self, instance_name: str, open_link: Opener = SerialLink) -> None:
        super().__init__(instance_name)
        self._open_link = open_link
        self._master: ModbusMaster | None = None
        self._bind()
        self.velocity = self.add_port(InPort("InTargetVelocity", iis.TimedVelocity2D))
        self.angles = self.add_port(OutPort("OutWheelAngle", TimedDoubleSeq))
        for port_name in ("InventGUIRefHard", "BumpRefHard"):
            port = self.add_port(ServicePort(port_name))
            port.provide(Provider[RefHard]("service", "RefHard", self))
        self._counts, self._angles = (0, 0), [0.0, 0.0]
        self.error_reason = ""
        self._forget()

    def _bind(self) -> None:
        bind = self.configuration.bind
        self.device = bind("DeviceFileName", "/dev/ttyUSB0")
        self.any_device = bind("AnyDevice", 0, "0<=x<=1")
        self.gains = tuple(
            bind(f"gain_{name}", default, "0<=x<=32767") for name, default in _GAINS.items()
        )
        self.velocity_limit = bind("Velocity_limit", 10.0, "x>0", unit="rad/s")
        self.acceleration_limit = bind("Acceleration_limit", 50.0, "x>0", unit="rad/s2")
        self.tread = bind("WheelTread", 0.441, "x>0", unit="m")
        self.radius_left = bind("WheelRadiusLeft", 0.1, "x>0", unit="m")
        self.radius_right = bind("WheelRadiusRight", 0.1, "x>0", unit="m")
        self.gear = bind("GearRatio", 74.91, "x>0")
        self.encoder = bind("EncoderCount", 2_000, "x>0")
        self.constants = (bind("EncoderConstant_L", 1.0), bind("EncoderConstant_R", 1.0))

    def _forget(self) -> None:
        self._orders: deque[modbus.Request] = deque()
        self._twist, self._stopped, self._refused = Twist(), False, 0
        self._identified = False
        self.report: modbus.Report | None = None

    @property
    def lost(self) -> int:
        """Number of requests that had no answer since the line was opened."""
        return self._master.lost if self._master else 0

    def Stop(self) -> None:  # noqa: N802 - as in the IDL
        """Command standstill until `Go`."""
        self._stopped = True

    def Go(self) -> None:  # noqa: N802
        """Apply the velocity at the port again, after `Stop`."""
        self._stopped = False

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Open the line to the base, clear its fault, write its settings, and switch it on."""
        self._forget()
        self.velocity.clear()
        if not all(constant.value for constant in self.constants):
            return self._failed("an EncoderConstant is 0")
        try:
            self._master = ModbusMaster(self._open_link(self.device.value))
        except LinkError as error:
            return self._failed(str(error))
        gains = (gain.value for gain in self.gains)
        limits = (self._limit(self.velocity_limit), self._limit(self.acceleration_limit))
        settings = (*gains, *(word for limit in limits for word in modbus.wide(limit)))
        start = (modbus.Mode.VELOCITY, modbus.Command.CLEAR_FAULT, _WATCHDOG_MS)
        self._identified = bool(self.any_device.value)
        if not self._identified:
            self._orders.append(_IDENTITY)
        self._orders.append(_MODE)
        self._orders.append(_write(modbus.Address.GAIN_P, *settings))
        self._orders.append(_write(modbus.Address.MODE, *start))
        self._orders.append(_write(modbus.Address.COMMAND, modbus.Command.ENABLE))
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Stop the base by its own ramp, and close the line."""
        if self._master is not None:
            try:
                if self._identified:
                    self._master.begin(_write(modbus.Address.COMMAND, modbus.Command.STOP))
            except LinkError as error:
                _LOG.warning("%s: %s", self.instance_name, error)
            self._master.close()
        self._master = None
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Read the answer of the previous period."""
        if self._master is None:
            return self._failed("no line")
        try:
            answer = self._master.poll()
        except LinkError as error:
            return self._failed(str(error))
        if answer is not None:
            return self._take(ec, answer)
        if self._master.misses >= _MAX_MISSES:
            return self._failed(f"no answer to {_MAX_MISSES} requests in a row")
        return ReturnCode.RTC_OK

    def on_state_update(self, ec: ExecutionContext) -> ReturnCode:
        """Send the speeds of this period."""
        if (latest := read_newest(self.velocity)) is not None:
            v, w = latest.data.vx, latest.data.va
            self._twist = Twist(v, w) if plausible(v, w) else Twist()
        if self._master is None or self._master.pending:
            return ReturnCode.RTC_OK
        try:
            self._master.begin(self._orders[0] if self._orders else self._cycle())
        except LinkError as error:
            return self._failed(str(error))
        return ReturnCode.RTC_OK

    @property
    def _counts_per_rad(self) -> float:
        return self.gear.value * self.encoder.value / tau

    def _limit(self, parameter: Parameter[float]) -> int:
        return min(round(parameter.value * self._counts_per_rad), _TURN // 2 - 1)

    def _cycle(self) -> modbus.Request:
        """Return the exchange of a period, which sends speeds and receives a report."""
        bumped = self.report is not None and bool(self.report.status & modbus.Status.BUMPER)
        twist = Twist() if self._stopped or bumped else self._twist
        speeds = wheel_speeds(
            twist, self.tread.value, self.radius_left.value, self.radius_right.value
        )
        share = min(1.0, self.velocity_limit.value / max(1e-9, *map(abs, speeds)))
        words: list[int] = []
        for speed, constant in zip(speeds, self.constants, strict=True):
            words += modbus.wide(round(speed * share * self._counts_per_rad * constant.value))
        return modbus.Request(
            modbus.READ_WRITE, modbus.REPORT, (modbus.Address.TARGET_SPEED_LEFT, tuple(words))
        )

    def _take(self, ec: ExecutionContext, answer: ModbusAnswer) -> ReturnCode:
        if answer.refusal is not None:
            self._refused += 1  # noise may have made another request of it
            if self._refused >= _MAX_MISSES:
                refusal = _refusal_text(answer.request, answer.refusal)
                return self._failed(f"the base refuses {refusal}{self._stranger}")
            return ReturnCode.RTC_OK
        self._refused = 0
        if self._orders:
            if self._orders[0] == _IDENTITY:
                if answer.values != (modbus.DEVICE_ID,):
                    says = ", ".join(f"{value:04X}h" for value in answer.values)
                    what = f"register 0000h is {says}, not {modbus.DEVICE_ID:04X}h"
                    return self._failed(f"{self.device.value}: {what}{self._stranger}")
                self._identified = True
            if self._orders.popleft() == _MODE and answer.values == (modbus.Mode.FREE,):
                self._counts = (0, 0)  # it was without power
            return ReturnCode.RTC_OK
        self.report = report = modbus.Report.parse(answer.values)
        self._turn(report)
        now = Time.from_us(ec.now_us)
        self.angles.write(TimedDoubleSeq(now, tuple(self._angles)))
        if report.status & modbus.Status.FAULT:
            faults = _fault_text(report.fault_left, report.fault_right)
            return self._failed(f"fault of the base: {faults}")
        return ReturnCode.RTC_OK

    @property
    def _stranger(self) -> str:
        """Addition to a failure text while the device may be another device than a base."""
        if self._identified:
            return ""
        return "; not an RH3 base, so nothing was written (rh3 --any-device goes on)"

    def _turn(self, report: modbus.Report) -> None:
        """Add the change of the counters, which begin again after 2**32."""
        counts = (report.left, report.right)
        for place, constant in enumerate(self.constants):
            change = (counts[place] - self._counts[place] + _TURN // 2) % _TURN - _TURN // 2
            self._angles[place] += change / (self._counts_per_rad * constant.value)
        self._counts = counts

    def _failed(self, why: str) -> ReturnCode:
        self.error_reason = why
        _LOG.error("%s: %s", self.instance_name, why)
        return ReturnCode.RTC_ERROR


def _write(address: modbus.Address, *values: int) -> modbus.Request:
    return modbus.Request(modbus.WRITE, write=(address, tuple(int(value) for value in values)))


def _fault_text(left: modbus.Fault, right: modbus.Fault) -> str:
    """Return the fault texts, each with the wheels that have the fault.

    >>> _fault_text(modbus.Fault.EMERGENCY_STOP | modbus.Fault.STALL, modbus.Fault.EMERGENCY_STOP)
    'stall (left), emergency stop (left, right)'
    >>> _fault_text(modbus.Fault(0x20), modbus.Fault(0))
    'fault 20h (left)'
    """
    sides = {"left": left, "right": right}
    bits = [1 << place for place in range((left | right).bit_length())]
    named = {bit: ", ".join(side for side, fault in sides.items() if fault & bit) for bit in bits}
    return ", ".join(f"{_name(bit)} ({who})" for bit, who in named.items() if who) or "unknown"


def _name(bit: int) -> str:
    return _words(modbus.Fault(bit).name or f"fault {bit:02X}h")


def _refusal_text(request: modbus.Request, code: modbus.ExceptionCode | int) -> str:
    """Return which request was refused, and the reason.

    >>> _refusal_text(modbus.Request(3, (0x10, 1)), modbus.ExceptionCode.ILLEGAL_DATA_ADDRESS)
    'function 03h at 0010h: illegal data address'
    """
    first, _ = request.write or request.read or (0, 0)
    why = (
        _words(code.name)
        if isinstance(code, modbus.ExceptionCode)
        else f"exception code {code:02X}h"
    )
    return f"function {request.function:02X}h at {first:04X}h: {why}"


def _words(name: str) -> str:
    return name.lower().replace("_", " ")
