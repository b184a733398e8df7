"""The proxy, which is an ordinary RT component whose work a small device does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, ClassVar, Final

from tickrig.host.links.link import DeviceRefused, Link, LinkError, LinkTimeout
from tickrig.host.rtc.component import ComponentProfile, ExecutionContext, ModuleSpec, RtComponent
from tickrig.host.rtc.lite import events
from tickrig.host.rtc.lite.request_channel import RETRIES, ProxySettings, RequestChannel
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.port import AnyPort
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.text.log import log_of
from tickrig.wire.errors import FieldError, WireError
from tickrig.wire.rtc_lite import messages
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteContextType, LiteState, LiteStatus
from tickrig.wire.rtc_lite.values import PORT_TYPES, LitePortType
from tickrig.wire.rtc_types import rtc
from tickrig.wire.rtc_types.rtc import Time

# The dialogue before a proxy is an RT component: state, profile, execution context, initialize.


@dataclass(frozen=True, slots=True)
class DeviceProfile:
    """Description of an RTC-Lite device, as reported by the device: component type and ports.

    Attributes:
        type_name: type of the component on the device.
        in_ports: in-ports of the device.
        out_ports: out-ports of the device.
        context: kind of the execution context that runs the component on the device.
    """

    type_name: str
    in_ports: tuple[messages.LitePortProfile, ...]
    out_ports: tuple[messages.LitePortProfile, ...]
    context: LiteContextType

    @property
    def properties(self) -> dict[str, str]:
        """Properties of the device in the profile of its proxy."""
        return {"rtc_lite.type_name": self.type_name, "rtc_lite.context": f"0x{self.context:02X}"}


def _start_up(channel: RequestChannel, boot_us: int) -> DeviceProfile:
    """Bring a device to Inactive and read its profile.

    Raises:
        LinkTimeout: the device does not reply.
        DeviceRefused: a reply does not lead to Inactive.
        WireError: the profile cannot be read.
    """
    channel.listen(boot_us)
    _demand(LiteCommand.STATE, channel.request_again(LiteCommand.STATE))
    if channel.state is LiteState.ACTIVE:
        _demand(LiteCommand.DEACTIVATE, channel.request(LiteCommand.DEACTIVATE))
    elif channel.state is LiteState.ERROR:
        _demand(LiteCommand.RESET, channel.request(LiteCommand.RESET))
    profile = _request_profile(channel)
    if channel.state is LiteState.CREATED:
        _demand(LiteCommand.INITIALIZE, channel.request(LiteCommand.INITIALIZE))
    if channel.state is not LiteState.INACTIVE:
        state = "unknown" if channel.state is None else channel.state.name
        raise DeviceRefused(f"the state of the device is {state}, not INACTIVE", state)
    channel.pushed.clear()
    return profile


def _request_profile(channel: RequestChannel) -> DeviceProfile:
    reply = _demand(LiteCommand.PROFILE, channel.request_again(LiteCommand.PROFILE))
    announced = messages.parse_component_profile(reply.fields)
    ins, outs = tuple(channel.in_ports), tuple(channel.out_ports)
    if (len(ins), len(outs)) != (announced.in_ports, announced.out_ports):
        counts = f"{announced.in_ports} in-ports and {announced.out_ports} out-ports"
        raise DeviceRefused(f"{counts} announced, {len(ins)} and {len(outs)} described", "CZ")
    return DeviceProfile(
        announced.type_name.decode("latin-1"), ins, outs, _request_context(channel)
    )


def _request_context(channel: RequestChannel) -> LiteContextType:
    code = _demand(LiteCommand.CONTEXT, channel.request_again(LiteCommand.CONTEXT)).fields[0]
    try:
        return LiteContextType(code)
    except ValueError:
        text = f"execution context 0x{code:02X}, 0x21 and 0x22 are known"
        raise DeviceRefused(text, "BB") from None


def _demand(command: LiteCommand, reply: messages.LiteReply | None) -> messages.LiteReply:
    """Return a reply that exists and is OK."""
    name = command.value.decode()
    if reply is None:
        raise LinkTimeout(f"no reply to {name}")
    if not reply.ok:
        raise DeviceRefused(f"{name} was refused with {reply.status:#04x}", chr(reply.status))
    return reply


# Ports of a proxy, made from the profile of its device, and the conversion of their values
# (DECISION L10).
#
# The wire does not carry the time of a value. The proxy stamps a value when it arrives.


@dataclass(frozen=True, slots=True)
class _InPortBridge:
    """An InPort of the proxy, with the in-port of the device that it feeds."""

    port: InPort[Any]
    name: bytes
    port_type: LitePortType[Any]

    @classmethod
    def of(cls, profile: messages.LitePortProfile) -> _InPortBridge:
        """Make the proxy's InPort for a device's in-port.

        Raise DeviceRefused for an unknown type.
        """
        name, port_type = _read(profile)
        return cls(InPort(name, getattr(rtc, port_type.name)), profile.name, port_type)

    def take(self) -> messages.LitePortData | None:
        """Return the oldest unread value of the InPort, encoded for the device, or None.

        Raises:
            FieldError: the value is not in the range of its type, or does not fit into a frame.
        """
        value = self.port.read() if self.port.is_new else None
        if value is None:
            return None
        bare = value.data
        if self.port.data_type is rtc.TimedOctetSeq:
            bare = tuple(bare)
        elif self.port.data_type is rtc.TimedCharSeq:
            bare = "".join(bare)
        return messages.LitePortData(self.name, self.port_type.encode(bare))


@dataclass(frozen=True, slots=True)
class _OutPortBridge:
    """An OutPort of the proxy, with the out-port of the device that feeds it."""

    port: OutPort[Any]
    port_type: LitePortType[Any]

    @classmethod
    def of(cls, profile: messages.LitePortProfile) -> _OutPortBridge:
        """Make the proxy's OutPort for a device's out-port.

        Raise DeviceRefused for an unknown type.
        """
        name, port_type = _read(profile)
        return cls(OutPort(name, getattr(rtc, port_type.name)), port_type)

    def give(self, data: bytes, now_us: int) -> None:
        """Decode a value received from the device, and write it to the OutPort.

        Raises:
            FieldError: the data are not a value of the port's type.
        """
        kind = self.port.data_type
        value = self.port_type.decode(data)
        if kind is rtc.TimedOctetSeq:
            value = bytes(value)
        elif kind is rtc.TimedCharSeq:
            value = tuple(value)
        self.port.write(kind(Time.from_us(now_us), value))


def _read(profile: messages.LitePortProfile) -> tuple[str, LitePortType[Any]]:
    name = profile.name.decode("latin-1")
    if (port_type := PORT_TYPES.get(profile.code)) is None:
        known = " ".join(PORT_TYPES)
        raise DeviceRefused(f"port {name!r} has type {profile.code!r}; known: {known}", "CZ")
    return name, port_type


_LOG: Final = log_of(__name__)


class PortBridges:
    """The ports of a proxy, each of which exchanges values with a port of the device.

    The ports are made from the profile of the device. Values that the device cannot receive, and
    data for an unknown port, are logged and dropped. They do not stop the proxy.

    Args:
        ins: in-ports of the device.
        outs: out-ports of the device.

    Attributes:
        dropped: number of values that were dropped.

    Raises:
        DeviceRefused: a port has an unknown type.
    """

    def __init__(
        self,
        ins: Iterable[messages.LitePortProfile] = (),
        outs: Iterable[messages.LitePortProfile] = (),
    ) -> None:
        self._ins = [_InPortBridge.of(profile) for profile in ins]
        self._outs = {profile.name: _OutPortBridge.of(profile) for profile in outs}
        self.dropped = 0

    @property
    def ports(self) -> Iterator[AnyPort]:
        """The InPorts followed by the OutPorts."""
        return chain((relay.port for relay in self._ins), (r.port for r in self._outs.values()))

    def fresh(self) -> Iterator[messages.LitePortData]:
        """Take one new value from each InPort that has one."""
        for relay in self._ins:
            try:
                data = relay.take()
            except FieldError as error:
                self._drop(relay.port.full_name, error)
            else:
                if data is not None:
                    yield data

    def give(self, at_us: int, data: messages.LitePortData) -> None:
        """Write data from the device to an OutPort."""
        if (relay := self._outs.get(data.name)) is None:
            self._drop("an out-port that was not described", repr(data.name))
            return
        try:
            relay.give(data.data, at_us)
        except FieldError as error:
            self._drop(relay.port.full_name, error)

    def _drop(self, where: str, why: FieldError | str) -> None:
        self.dropped += 1
        _LOG.warning("dropped at %s: %s", where, why)


_MIRROR_US: Final = 100_000
"""Interval of state requests to a device with its own timer, which is every 10th tick."""

_MAX_RATE_HZ: Final = 0xFFFF

_OK: Final = ReturnCode.RTC_OK
_CODES: Final[dict[int, ReturnCode]] = {
    LiteStatus.OK: ReturnCode.RTC_OK,
    LiteStatus.WRONG_STATE: ReturnCode.PRECONDITION_NOT_MET,
    LiteStatus.NO_IN_PORT: ReturnCode.BAD_PARAMETER,
    LiteStatus.NO_OUT_PORT: ReturnCode.BAD_PARAMETER,
    LiteStatus.UNSUPPORTED: ReturnCode.UNSUPPORTED,
}
"""Results of a callback by status. Any other status, or no reply, is RTC_ERROR."""

_TO_INACTIVE: Final = {
    LiteState.CREATED: LiteCommand.INITIALIZE,
    LiteState.ACTIVE: LiteCommand.ABORT,
    LiteState.ERROR: LiteCommand.RESET,
}
"""Request that brings a device one step nearer to Inactive, for on_reset of the proxy."""


class RtcLiteProxy(RtComponent):
    """An RT component that represents an RTC-Lite component (Suzuki et al., RSJ 2007).

    Each callback sends the request of the same name to the device, and waits for the reply within
    the period, 100 ms at most. Therefore input data affect the output of the same period. Call
    `tick` at `due_us`, so that PINGs are sent. `attach` arranges this.

    Not emulated: service ports and configuration sets, which RTC-Lite does not have.

    Args:
        instance_name: name that is unique in a system.
        link: line to the device. Its clock is the clock of the proxy.
        settings: settings with time limits and checksum.
        listener: function that is called with events.

    Attributes:
        device: profile of the device, or None before `on_initialize`.
        relays: ports of the proxy. There are none before `on_initialize`.
        fatal_us: time at which the device was lost, or None while it answers.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec(
        "RtcLiteProxy", "Proxy of an RTC-Lite component", category="RTC-Lite"
    )

    def __init__(
        self,
        instance_name: str,
        link: Link[bytes],
        settings: ProxySettings | None = None,
        listener: events.ProxyListener | None = None,
    ) -> None:
        super().__init__(instance_name)
        self._settings, self._listener = settings or ProxySettings(), listener
        self._link, self._channel = link, RequestChannel(link, self._settings)
        self.device: DeviceProfile | None = None
        self.relays = PortBridges()
        self.fatal_us: int | None = None
        self._failed = False  # a callback failed, so that Error comes next
        self._unreported = False  # an error that may or may not be fatal
        self._mirrored = -1  # in which ten ticks its state was asked
        self._unanswered = 0  # how often in vain
        self._why: tuple[str, tuple[str, ...]] = "", ()  # it went to Error, and the last frames

    @property
    def due_us(self) -> int:
        """Time at which `tick` has work to do, on the clock of the link."""
        return self._channel.due_us

    @property
    def device_state(self) -> LiteState | None:
        """Last reported state of the device, or None if unknown."""
        return self._channel.state

    @property
    def profile(self) -> ComponentProfile:
        """Profile of the component, with the type of the device's component and its PINGs."""
        pings = {"rtc_lite.pings": str(self.pings).removeprefix("PINGs: ")}
        properties = {} if self.device is None else {**self.device.properties, **pings}
        return replace(super().profile, properties=properties)

    @property
    def pings(self) -> events.PingStatistics:
        """Statistics of the PINGs since `on_initialize`."""
        return self._channel.ping_monitor.statistics

    def tick(self) -> None:
        """Send PINGs and read their answers. A lost device leads to Error."""
        self._channel.tick()
        if self._channel.ping_monitor.lost and self.fatal_us is None:
            self.fatal_us, self._unreported = self._channel.now_us, False
            before = f"{self._channel.trouble}, and " if self._channel.trouble else ""
            pings = f"none of {self._settings.pings} PINGs was answered"
            self._why = before + pings, self._channel.frames
            self._notify(events.ProxyEventType.FATAL_ERROR)
            for context in self.contexts:
                context.abort_component(self)

    def on_initialize(self) -> ReturnCode:
        """Read the profile of the device, and bring the device to Inactive.

        The proxy gets the same ports as the device.
        """
        for port in tuple(self.ports.values()):
            self.remove_port(port)
        self._channel = RequestChannel(self._link, self._settings)
        try:
            self.device = _start_up(self._channel, self._settings.boot_us)
            self.relays = PortBridges(self.device.in_ports, self.device.out_ports)
            for port in self.relays.ports:
                self.add_port(port)
            self._channel.ping_monitor.start(self._channel.now_us)
        except (LinkError, DeviceRefused, WireError, RtcRefused) as error:
            _LOG.warning("%s: no start-up: %s", self.instance_name, error)
            return ReturnCode.RTC_ERROR
        return _OK

    def on_finalize(self) -> ReturnCode:
        """Finalize the device."""
        return self._command(LiteCommand.FINALIZE)

    def on_startup(self, ec: ExecutionContext) -> ReturnCode:
        """Notify the device of the start, if it has this callback."""
        return self._optional(LiteCommand.STARTUP)

    def on_shutdown(self, ec: ExecutionContext) -> ReturnCode:
        """Notify the device of the stop, if it has this callback."""
        return self._optional(LiteCommand.SHUTDOWN)

    def on_rate_changed(self, ec: ExecutionContext) -> ReturnCode:
        """Set the new rate, rounded to whole Hz, in a device that executes by its own timer.

        Other devices need no rate, because the proxy triggers each execution.
        """
        if not self._by_timer:
            return _OK
        rate_hz = min(max(1, round(ec.rate_hz)), _MAX_RATE_HZ)
        return self._command(LiteCommand.RATE, rate_hz.to_bytes(2, "little"))

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Activate the device."""
        code, self._unanswered = self._command(LiteCommand.ACTIVATE), 0
        self._failed = code is not _OK
        return code

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Deactivate the device. If Error comes next, the device is aborted later instead."""
        code = _OK if self._failed else self._command(LiteCommand.DEACTIVATE)
        self._write_out_ports()
        return code

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Send input data, let the device execute, and receive output data."""
        code = _OK if self._mute else self._write_in_ports()
        if code is _OK:
            code = self._mirror(ec.now_us) if self._by_timer else self._command(LiteCommand.EXECUTE)
        self._write_out_ports()
        self._failed = code is not _OK
        return code

    def on_aborting(self, ec: ExecutionContext) -> ReturnCode:
        """Move the device to Error too, if it is not in Error."""
        self._unreported = self.fatal_us is None
        if self._unreported:
            self._why = self._channel.trouble or "it was commanded to abort", self._channel.frames
        self._notify_passive()
        return self._follow()

    def on_error(self, ec: ExecutionContext) -> ReturnCode:
        """Make the device execute its on_error.

        If the device is still Active because a reply was lost, move it to Error first.
        """
        self._notify_passive()
        code = self._follow()
        if self._channel.state is LiteState.ERROR and not self._by_timer:
            code = self._command(LiteCommand.ERROR)
        self._write_out_ports()
        return code

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        """Bring the device to Inactive from any state."""
        for _ in _TO_INACTIVE:  # no state is passed twice
            state = self._known_state()
            step = None if state is None else _TO_INACTIVE.get(state)
            if step is None or self._command(step) is ReturnCode.RTC_ERROR:
                break
        return _OK if self._channel.state is LiteState.INACTIVE else ReturnCode.RTC_ERROR

    @property
    def _by_timer(self) -> bool:
        return self.device is not None and self.device.context is LiteContextType.TIMER

    @property
    def _mute(self) -> bool:
        """Whether a self-executing device gets no requests until it answers a PING."""
        return self._by_timer and self._channel.ping_monitor.doubted

    def _command(self, command: LiteCommand, data: bytes = b"") -> ReturnCode:
        return _code_of(self._channel.request(command, data))

    def _optional(self, command: LiteCommand) -> ReturnCode:
        """Request a callback that a device need not have. A missing callback is not a fault."""
        if (code := self._command(command)) is not ReturnCode.UNSUPPORTED:
            return code
        self._channel.trouble = ""
        return _OK

    def _known_state(self) -> LiteState | None:
        """Return the state of the device. Request the state if it is unknown."""
        if self._channel.state is None:
            self._channel.request(LiteCommand.STATE)
        return self._channel.state

    def _follow(self) -> ReturnCode:
        if self._known_state() is LiteState.ACTIVE:
            return self._command(LiteCommand.ABORT)
        return _OK

    def _mirror(self, now_us: int) -> ReturnCode:
        """Request once in 10 ticks whether the device is still Active.

        Repeat up to 3 times in vain.
        """
        if self._mute or now_us // _MIRROR_US == self._mirrored:
            self._channel.poll()
            return _OK
        self._mirrored = now_us // _MIRROR_US
        reply = self._channel.request(LiteCommand.STATE)
        self._unanswered = 0 if reply else self._unanswered + 1
        if reply is None and self._unanswered <= RETRIES:
            return _OK
        code = _code_of(reply)
        if code is _OK and self._channel.state is not LiteState.ACTIVE:
            self._channel.trouble = "the device is no longer Active"
            return ReturnCode.RTC_ERROR
        return code

    def _write_in_ports(self) -> ReturnCode:
        """Write one new value to each in-port of the device that has one."""
        for data in self.relays.fresh():
            if (code := self._command(LiteCommand.WRITE, data.encode())) is not _OK:
                return code
        return _OK

    def _write_out_ports(self) -> None:
        """Write the received data to the OutPorts."""
        pushed, self._channel.pushed = self._channel.pushed, []
        for at_us, data in pushed:
            self.relays.give(at_us, data)

    def _notify_passive(self) -> None:
        """Report an error when it is known that the device answers."""
        if self._unreported and not self._channel.ping_monitor.doubted:
            self._unreported = False
            self._notify(events.ProxyEventType.PASSIVE_ERROR)

    def _notify(self, kind: events.ProxyEventType) -> None:
        events.notify(
            self._listener,
            events.ProxyEvent(self._channel.now_us, kind, self.instance_name, *self._why),
        )


def _code_of(reply: messages.LiteReply | None) -> ReturnCode:
    error = ReturnCode.RTC_ERROR
    return error if reply is None else _CODES.get(reply.status, error)
