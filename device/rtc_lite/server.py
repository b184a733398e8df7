"""What a node answers to each request (DECISION L9 to L12)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from tickrig.device.rtc_lite.config import RATE_HZ
from tickrig.device.rtc_lite.life_cycle import LifeCycle
from tickrig.device.rtc_lite.ports import Port
from tickrig.device.timer import Timer
from tickrig.wire.rtc_lite.codes import Command, ContextType, State, Status
from tickrig.wire.rtc_lite.frame import Frame
from tickrig.wire.rtc_lite.layout import WITH_FIELDS
from tickrig.wire.rtc_lite.messages import (
    ComponentProfile,
    PortData,
    PortProfile,
    Reply,
    parse_port_data,
)

BY_CONTEXT: Final = (Command.EXECUTE, Command.ERROR)
"""What the device's own timer does, so that the proxy may not (type 22h)."""


@dataclass(slots=True)
class Server:
    """Answers the requests of the proxy. It knows no time.

    Attributes:
        life: the component and its state.
        context: who makes the component execute.
        timer: whose rate can be set.
    """

    life: LifeCycle
    context: ContextType
    timer: Timer

    def answer(self, request: Frame) -> list[Frame]:
        """Do what a request asks for, and return the frames to send."""
        match request.command:
            case Command.PROFILE:
                return self._profile()
            case Command.STATE:
                reply = Reply(Status.OK, bytes([self.life.state]))
            case Command.PING:
                reply = Reply(Status.OK, request.data)
            case Command.CONTEXT:
                reply = Reply(Status.OK, bytes([self.context]))
            case Command.RATE:
                reply = Reply(self._set_rate(int.from_bytes(request.data, "little")))
            case Command.WRITE:
                reply = Reply(self._write(parse_port_data(request.data)))
            case Command.POLL:
                reply = self._poll(request.data[1:])
            case command:
                return self._live(command)
        return [Frame(request.command, reply.encode())]

    def execute(self) -> list[Frame]:
        """Run one period of the timer, and return the data to push."""
        active = self.life.state is State.ACTIVE
        self.life.obey(Command.EXECUTE if active else Command.ERROR)
        return self._fresh_data()

    def _live(self, command: Command) -> list[Frame]:
        """Let the life cycle go on; data go before the reply (DECISION L12)."""
        if self.context is ContextType.TIMER and command in BY_CONTEXT:
            status = Status.UNSUPPORTED
        else:
            status = self.life.obey(command)
        executed = command is Command.EXECUTE and status in (Status.OK, Status.ERROR)
        fields = bytes([self.life.state]) if status in WITH_FIELDS else b""
        reply = Frame(command, Reply(status, fields).encode())
        return [*self._fresh_data(), reply] if executed else [reply]

    def _fresh_data(self) -> list[Frame]:
        """Take what is new out of the out-ports."""
        return [
            Frame(Command.DATA, PortData(port.name, port.take()).encode())
            for port in self.life.component.out_ports.values()
            if port.is_new
        ]

    def _profile(self) -> list[Frame]:
        """Describe the ports, then the component."""
        component = self.life.component
        ins, outs = component.in_ports.values(), component.out_ports.values()
        end = ComponentProfile(len(ins), len(outs), component.type_name.encode())
        return [
            *(Frame(Command.IN_PROFILE, _profile_of(port)) for port in ins),
            *(Frame(Command.OUT_PROFILE, _profile_of(port)) for port in outs),
            Frame(Command.PROFILE, Reply(Status.OK, end.encode()).encode()),
        ]

    def _set_rate(self, rate_hz: int) -> Status:
        """Set the rate of the timer; it starts again with it."""
        if self.context is not ContextType.TIMER or rate_hz not in RATE_HZ:
            return Status.UNSUPPORTED
        self.timer.rate_hz = rate_hz
        self.timer.stop()
        return Status.OK

    def _write(self, sent: PortData) -> Status:
        port = self.life.component.in_ports.get(sent.name)
        if port is None:
            return Status.NO_IN_PORT
        return Status.OK if port.accept(sent.data) else Status.UNSUPPORTED

    def _poll(self, name: bytes) -> Reply:
        port = self.life.component.out_ports.get(name)
        if port is None:
            return Reply(Status.NO_OUT_PORT)
        if not port.is_new:
            return Reply(Status.EMPTY)
        data = port.take()
        return Reply(Status.OK, bytes([len(data)]) + data)


def _profile_of(port: Port[Any]) -> bytes:
    return PortProfile(port.port_type.code, port.name).encode()
