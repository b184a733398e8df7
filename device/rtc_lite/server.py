"""Answers of a node to each request (DECISION L9 to L12)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from tickrig.device.component import Timer
from tickrig.device.rtc_lite.component import LitePort
from tickrig.device.rtc_lite.life_cycle import LiteLifeCycle
from tickrig.device.twin import Immutable
from tickrig.wire.rtc_lite import messages
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteContextType, LiteState, LiteStatus
from tickrig.wire.rtc_lite.frame import WITH_FIELDS, Checksum, Framing, LiteFrame

# Configuration: differences between nodes, and points that the paper leaves open.

_RATE_HZ: Final = range(1, 1_001)
"""Rates that are possible with a tick of 1 ms."""
DEFAULT_RATE_HZ: Final = 10


@dataclass(frozen=True, slots=True)
class LiteConfig(Immutable):
    """Configuration of an emulated RTC-Lite node: its framing, checksum and execution context.

    Attributes:
        framing: format of the data on the line: frames of RTC-Lite, or packets of RTno, a protocol
            that is closely related to RTC-Lite. The use of RTno packets is called bridge mode.
        checksum: algorithm of the checksum (DECISION L5). Packets of RTno always use `sum8`.
        context: type of the execution context, which decides when `on_execute` runs.
        rate_hz: rate of the timer, 1..1000 Hz, until the proxy sets another rate.
        slow_answer_us: delay of each answer while the fault `slow_answer` is present.

    Raises:
        ValueError: a rate or a delay is out of range.
    """

    framing: Framing = Framing.LITE
    checksum: Checksum = Checksum.SUM8
    context: LiteContextType = LiteContextType.PROXY
    rate_hz: int = DEFAULT_RATE_HZ
    slow_answer_us: int = 200_000

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range."""
        if self.rate_hz not in _RATE_HZ:
            raise ValueError(f"rate_hz is {self.rate_hz}, 1..{_RATE_HZ[-1]} is possible")
        if self.slow_answer_us < 1:
            raise ValueError(f"slow_answer_us is {self.slow_answer_us}, at least 1 is needed")
        if self.framing is Framing.RTNO and self.checksum is not Checksum.SUM8:
            raise ValueError(f"checksum is {self.checksum}, packets of RTno have sum8")


_BY_CONTEXT: Final = (LiteCommand.EXECUTE, LiteCommand.ERROR)
"""Commands of the device's own timer, which the proxy may not send (type 22h)."""


@dataclass(slots=True)
class LiteServer:
    """Executes the requests that an RTC-Lite node receives, and returns the answers.

    The node is an emulated device with a component. A proxy on a PC sends the requests. The server
    has no clock. The node calls `execute` when the timer's period has ended.

    Attributes:
        life: life cycle of the component, with its state.
        context: type of the execution context.
        timer: the timer whose rate the proxy can set.
    """

    life: LiteLifeCycle
    context: LiteContextType
    timer: Timer

    def answer(self, request: LiteFrame) -> list[LiteFrame]:
        """Execute a request, and return the frames to send."""
        match request.command:
            case LiteCommand.PROFILE:
                return self._profile()
            case LiteCommand.STATE:
                reply = messages.LiteReply(LiteStatus.OK, bytes([self.life.state]))
            case LiteCommand.PING:
                reply = messages.LiteReply(LiteStatus.OK, request.data)
            case LiteCommand.CONTEXT:
                reply = messages.LiteReply(LiteStatus.OK, bytes([self.context]))
            case LiteCommand.RATE:
                reply = messages.LiteReply(self._set_rate(int.from_bytes(request.data, "little")))
            case LiteCommand.WRITE:
                reply = messages.LiteReply(self._write(messages.parse_port_data(request.data)))
            case LiteCommand.POLL:
                reply = self._poll(request.data[1:])
            case command:
                return self._live(command)
        return [LiteFrame(request.command, reply.encode())]

    def execute(self) -> list[LiteFrame]:
        """Run one period of the timer, and return the data to send."""
        active = self.life.state is LiteState.ACTIVE
        self.life.obey(LiteCommand.EXECUTE if active else LiteCommand.ERROR)
        return self._fresh_data()

    def _live(self, command: LiteCommand) -> list[LiteFrame]:
        """Execute a life cycle command; data go before the reply (DECISION L12)."""
        if self.context is LiteContextType.TIMER and command in _BY_CONTEXT:
            status = LiteStatus.UNSUPPORTED
        else:
            status = self.life.obey(command)
        # If the state (`H`) or the timer context (`!`) refuses the command, nothing ran, so no
        # value is new. After a failure (`x`) the values that on_execute wrote before it failed are
        # still sent.
        executed = command is LiteCommand.EXECUTE and status in (LiteStatus.OK, LiteStatus.ERROR)
        # The state is the one after the command. With `!` the reply ends after the status, because
        # the parser of the proxy derives the length from the status (spec, section 4).
        fields = bytes([self.life.state]) if status in WITH_FIELDS else b""
        reply = LiteFrame(command, messages.LiteReply(status, fields).encode())
        return [*self._fresh_data(), reply] if executed else [reply]

    def _fresh_data(self) -> list[LiteFrame]:
        """Take new values from the out-ports."""
        return [
            LiteFrame(LiteCommand.DATA, messages.LitePortData(port.name, port.take()).encode())
            for port in self.life.component.out_ports.values()
            if port.is_new
        ]

    def _profile(self) -> list[LiteFrame]:
        """Describe the ports, then the component."""
        component = self.life.component
        ins, outs = component.in_ports.values(), component.out_ports.values()
        end = messages.LiteComponentProfile(len(ins), len(outs), component.type_name.encode())
        return [
            *(LiteFrame(LiteCommand.IN_PROFILE, _profile_of(port)) for port in ins),
            *(LiteFrame(LiteCommand.OUT_PROFILE, _profile_of(port)) for port in outs),
            LiteFrame(
                LiteCommand.PROFILE, messages.LiteReply(LiteStatus.OK, end.encode()).encode()
            ),
        ]

    def _set_rate(self, rate_hz: int) -> LiteStatus:
        """Set the rate of the timer and restart it."""
        if self.context is not LiteContextType.TIMER or rate_hz not in _RATE_HZ:
            return LiteStatus.UNSUPPORTED
        self.timer.rate_hz = rate_hz
        # `_update_timer` of the node starts it again, with the new period from now on.
        self.timer.stop()
        return LiteStatus.OK

    def _write(self, sent: messages.LitePortData) -> LiteStatus:
        port = self.life.component.in_ports.get(sent.name)
        if port is None:
            return LiteStatus.NO_IN_PORT
        return LiteStatus.OK if port.accept(sent.data) else LiteStatus.UNSUPPORTED

    def _poll(self, name: bytes) -> messages.LiteReply:
        port = self.life.component.out_ports.get(name)
        if port is None:
            return messages.LiteReply(LiteStatus.NO_OUT_PORT)
        if not port.is_new:
            return messages.LiteReply(LiteStatus.EMPTY)
        data = port.take()
        return messages.LiteReply(LiteStatus.OK, bytes([len(data)]) + data)


def _profile_of(port: LitePort[Any]) -> bytes:
    return messages.LitePortProfile(port.port_type.code, port.name).encode()
