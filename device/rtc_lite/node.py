"""A small device with a component, in ticks of 1 ms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Protocol

from tickrig.device.component import Timer, shown
from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.device.rtc_lite.component import LiteComponent, LitePort
from tickrig.device.rtc_lite.life_cycle import LiteLifeCycle
from tickrig.device.rtc_lite.server import LiteConfig, LiteServer
from tickrig.device.twin import Copyable
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteContextType, LiteLinkFault, LiteState
from tickrig.wire.rtc_lite.frame import REQUESTS, Framing, LiteDecoder, LiteFrame, fault_frame
from tickrig.wire.rtc_lite.rtno import RtnoDecoder, encode_packet

# Theory of operation
# ===================
#
# The node models the main loop of a small processor. It does one thing at a time and has a receive
# buffer of 64 bytes. In each tick of 1 ms, in this order:
#
# 1. Supply: without power nothing happens, and the node loses its state.
# 2. `_finish`: the answer whose dead time is over leaves; a frame that was broken off is dropped.
# 3. Bytes of the line go into the buffer, in pieces of at most 64. After each piece the node serves
#    the requests in it, one after the other, while the processor is free.
# 4. The timer of an execution context of type 22h runs, if the processor is free.
#
# `_free_us` stands for the processor: 0 while it is free, else the time at which it is free again.
# Callbacks act at once; only their answer waits (`callback_ms` for each callback, plus
# `slow_answer`). Until the answer leaves, the node reads no request and the timer does not execute.
# Bytes beyond 64 are lost and counted, which reveals a proxy with a wrong time-out. Everything that
# sends must use `_send`, because the dead time begins in it.
#
# The time-outs of the receiver (DECISION L7) need the time of the latest byte. So they are in this
# module and not in the decoder, which has no clock:
#
# - After 100 ms of silence inside a frame, the frame is dropped and answered `F K`. This does not
#   apply while bytes wait in the buffer: those bytes came in time, and only the processor was busy.
# - After `F U` (an unknown command, of unknown length) all bytes are dropped until 20 ms of
#   silence. Then the decoder begins to look for a header again.
#
# The frames of a dialogue, proxy to device and back (vectors L01 to L14 of the specification):
#
# 0A 43 58 9B                               C X        state?
#       0A 43 58 40 43 1E                   C X '@' 'C'  OK, Created
# 0A 50 53 02 04 69 6E 2A 00 00 00 AA       P S        2 and 4 bytes: "in" = 42
#       0A 50 53 40 E3                      P S '@'
# 0A 41 45 86                               A E        execute
#       0A 51 56 03 04 6F 75 74 2A .. 30    Q V        "out" = 42: before the reply (L12)
#       0A 41 45 40 41 07                   A E '@' 'A'  OK, Active
#
# What depends on what: server.py answers a request and has no clock; life_cycle.py holds states and
# callbacks. Both can be used without a line. A new request needs
#
# - its letters (wire codes.py),
# - its lengths in both directions (wire frame.py, because no frame contains its length), and
# - a case in `LiteServer.answer`.
#
# In bridge mode the request exists only if RTno has a letter for it (wire rtno.py). The timer
# follows the state after each request (`_update_timer`). It runs in Active and in Error, because
# `on_error` is called once a period, as `on_execute` is.
#
# Numbers: 64 bytes and 100 ms are RTno's values, 20 ms comes from L7, the tick is our choice. Rates
# go up to 1000 Hz, the most that a tick of 1 ms allows.

# Bytes from the line: a buffer of 64 bytes, its frames, and time-outs (DECISION L7).

BUFFER_BYTES: Final = 64
GAP_US: Final = 100_000
"""Length of a silence inside a frame after which the frame is dropped."""
SILENCE_US: Final = 20_000
"""Length of the silence that a receiver needs after a frame of unknown length."""


class RequestDecoder(Protocol):
    """Interface of `Decoder` and `RtnoDecoder`."""

    lost: bool

    @property
    def begun(self) -> bool:
        """Whether an incomplete frame has started."""
        ...

    def clear(self) -> None:
        """Look for a header again."""

    def push(self, data: bytes, /) -> list[LiteFrame | LiteLinkFault]:
        """Receive bytes; return frames and faults."""
        ...


@dataclass(slots=True)
class LiteReceiver:
    """The receive buffer of a node on its serial line, with the decoder of the frames.

    Attributes:
        decoder: decoder that reads the frames.
        dropped: number of bytes that were dropped because the buffer was full.
    """

    decoder: RequestDecoder
    dropped: int = field(default=0, init=False)
    _waiting: bytes = field(default=b"", init=False)
    _received_us: int = field(default=0, init=False)  # when the latest byte came

    @property
    def due_us(self) -> int:
        """Time at which an incomplete frame is dropped."""
        return self._received_us + GAP_US if self.decoder.begun else NEVER

    def push(self, now_us: int, data: bytes) -> None:
        """Receive bytes from the line, up to the room in the buffer."""
        if not data:
            return
        # Before the time of the byte is noted: the silence is the time between the last byte and
        # this one.
        if self.decoder.lost and now_us - self._received_us >= SILENCE_US:
            self.decoder.clear()
        self._received_us = now_us
        if not self.decoder.lost:
            room = BUFFER_BYTES - len(self._waiting)
            self._waiting += data[:room]
            self.dropped += max(0, len(data) - room)

    def drop_broken_off(self, now_us: int) -> bool:
        """Drop an incomplete frame; return whether there was one."""
        if self._waiting or now_us < self.due_us:
            return False
        self.decoder.clear()
        return True

    def pull(self) -> LiteFrame | LiteLinkFault | None:
        """Return the next frame or fault, and leave the following bytes in the buffer."""
        for at in range(len(self._waiting)):
            for found in self.decoder.push(self._waiting[at : at + 1]):
                # After an unknown command the rest of the buffer is noise, too.
                self._waiting = b"" if self.decoder.lost else self._waiting[at + 1 :]
                return found
        self._waiting = b""
        return None


# Physical inputs and outputs of a node: supply, processor, ports.

INPUTS: Final = (
    InputSignal("callback_ms", "how long each callback takes", high=10_000, unit="ms"),
    InputSignal("power_cut", "the supply is off, and everything is forgotten", SignalType.FAULT),
    InputSignal(
        "slow_answer", "the processor is busy elsewhere: each answer is late", SignalType.FAULT
    ),
)
"""Inputs of every node; a component may add inputs."""

_OUTPUTS: Final = (
    OutputSignal("state", "state of the component: Off, Created, Inactive, Active, Error, None"),
    OutputSignal("callback", "the callback that ran last"),
    OutputSignal("executed", "how often on_execute ran"),
    OutputSignal("dropped_bytes", "bytes that found the receive buffer full"),
)
"""Outputs of every node; each port adds its value."""


def _new_inputs(component: LiteComponent) -> InputBank:
    """Return the inputs of a node at rest.

    Raises:
        ValueError: two inputs have the same name.
    """
    names = {item.name for item in INPUTS}
    kind = type(component).__name__
    for item in component.physical:
        if item.name in names:
            raise ValueError(f"{kind}: two inputs are called {item.name!r}")
        names.add(item.name)
    return InputBank((*INPUTS, *component.physical))


def _output_table(component: LiteComponent) -> dict[str, OutputSignal]:
    """Return the outputs of a node, including its ports as `in.NAME` and `out.NAME`."""
    ports = [
        *(
            OutputSignal(f"in.{name.decode()}", "value of this in-port")
            for name in component.in_ports
        ),
        *(
            OutputSignal(f"out.{name.decode()}", "value of this out-port")
            for name in component.out_ports
        ),
    ]
    return {output.name: output for output in (*_OUTPUTS, *ports)}


def _port_text(component: LiteComponent, name: str) -> float | str:
    """Return the value of the port `in.NAME` or `out.NAME`; KeyError if there is no such port."""
    side, _, port = name.partition(".")
    ports: dict[str, Mapping[bytes, LitePort[Any]]] = {
        "in": component.in_ports,
        "out": component.out_ports,
    }
    return shown(ports[side][port.encode()].value)


TICK_US: Final = 1_000
"""Period of the main loop of the device, which is our choice because the paper gives no period."""

_TIMED: Final = (LiteState.ACTIVE, LiteState.ERROR)
"""States in which the timer of the device runs."""


@dataclass(slots=True)
class RtcLiteNode(Copyable):
    """A PIC with an RTC-Lite component (Suzuki et al., RSJ 2007); a `Device[bytes]`.

    In each tick the node processes bytes from the line, time-outs, requests in order, and the
    timer. A callback takes effect at once. If the node has a dead time, the answer comes late.
    Until then the node only fills its receive buffer of 64 bytes.

    Not emulated: service ports, configuration sets, the baud rate generator, framing errors of the
    UART, a watchdog, sleep.

    Args:
        make: factory of the component, which is called at the start and at each power-up.
        config: configuration with framing, execution context and rates.

    Attributes:
        type_name: name of the device type, for traces.
        inputs: physical inputs; see `INPUTS`.

    Raises:
        ValueError: the component does not fit into a PIC.
    """

    type_name: ClassVar[str] = "rtc-lite"
    make: Callable[[], LiteComponent]
    config: LiteConfig = field(default_factory=LiteConfig)
    inputs: InputBank = field(init=False)
    _on: bool = field(init=False)
    _life: LiteLifeCycle = field(init=False)
    _receiver: LiteReceiver = field(init=False)
    _timer: Timer = field(init=False)
    _server: LiteServer = field(init=False)
    _unsent: bytes = field(init=False)
    _free_us: int = field(init=False)  # when the processor is free again

    def __post_init__(self) -> None:
        """Start without power."""
        self.inputs = _new_inputs(self.make())
        self.reset()

    @property
    def tick_us(self) -> int:
        """The period of the main loop."""
        return TICK_US

    @property
    def due_us(self) -> int:
        """The time of the next event without input."""
        if self.inputs.changed:
            return 0
        if self._free_us:
            return self._free_us
        return min(self._receiver.due_us, self._timer.due_us)

    @property
    def component(self) -> LiteComponent:
        """The present component; a power cut makes a new component."""
        return self._life.component

    @property
    def outputs(self) -> dict[str, OutputSignal]:
        """The outputs that `read` accepts."""
        return _output_table(self.component)

    def reset(self) -> None:
        """Reset everything but configuration and physical inputs, as a power cut does."""
        component = self.make()
        component.inputs = self.inputs
        rtno = self.config.framing is Framing.RTNO
        self._life, self._timer = LiteLifeCycle(component), Timer(self.config.rate_hz)
        self._receiver = LiteReceiver(
            RtnoDecoder() if rtno else LiteDecoder(REQUESTS, self.config.checksum)
        )
        self._server = LiteServer(self._life, self.config.context, self._timer)
        self._unsent, self._free_us, self._on = b"", 0, False
        self.inputs.changed = True

    def read(self, name: str, /) -> float | str:
        """Return the value that a physical output had after the latest tick.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        life = self._life
        own: dict[str, float | str] = {
            "state": life.state.name.capitalize() if self._on else "Off",
            "callback": life.latest,
            "executed": life.executed,
            "dropped_bytes": self._receiver.dropped,
        }
        return own[name] if name in own else _port_text(life.component, name)

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Run one pass of the node's main loop: receive, answer requests, run the timer.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: bytes that have arrived since the latest tick.

        Returns:
            The bytes that the node sends in this tick.
        """
        if self.inputs["power_cut"]:
            if self._on:
                self.reset()
            self.inputs.changed = False
            return b""
        self.inputs.changed = False
        if not self._on:
            self._boot()
        sent = self._finish(now_us) if self._free_us <= now_us else b""
        # At a high bit rate a tick may bring more than 64 bytes. A free processor reads them as
        # they arrive, so they must not count as one burst. `or 1` makes the loop run without new
        # bytes too, so that waiting bytes are served.
        for at in range(0, len(rx) or 1, BUFFER_BYTES):
            self._receiver.push(now_us, rx[at : at + BUFFER_BYTES])
            self._serve(now_us)
        self._run_timer(now_us)
        # With a dead time the frames stay in `_unsent` until `_finish`.
        return sent if self._free_us else sent + self._take()

    def _finish(self, now_us: int) -> bytes:
        """Send the answer that is due, and check the time-outs of the line."""
        self._free_us = 0
        sent = self._take()
        if self._receiver.drop_broken_off(now_us):
            self._send(now_us, [fault_frame(LiteLinkFault.TIMEOUT)])
        return sent

    def _take(self) -> bytes:
        sent, self._unsent = self._unsent, b""
        return sent

    def _boot(self) -> None:
        """Start at power-up; RTno initializes itself, RTC-Lite awaits a command (DECISION L11)."""
        self._on = True
        if self.config.framing is Framing.RTNO:
            self._life.obey(LiteCommand.INITIALIZE)

    def _serve(self, now_us: int) -> None:
        """Answer the requests in the buffer while the processor is free."""
        while not self._free_us and (found := self._receiver.pull()) is not None:
            calls = self._life.calls
            if isinstance(found, LiteLinkFault):
                answer = [fault_frame(found)]
            else:
                answer = self._server.answer(found)
            self._send(now_us, answer, self._life.calls - calls)
            self._update_timer(now_us)

    def _run_timer(self, now_us: int) -> None:
        """Execute if a period has ended and the processor is free."""
        if not self._free_us and self._timer.elapsed(now_us):
            calls = self._life.calls
            self._send(now_us, self._server.execute(), self._life.calls - calls)

    def _update_timer(self, now_us: int) -> None:
        """Run the timer in the states that need it."""
        if self.config.context is LiteContextType.TIMER and self._life.state in _TIMED:
            self._timer.run(now_us)
        else:
            self._timer.stop()

    def _send(self, now_us: int, frames: list[LiteFrame], calls: int = 0) -> None:
        """Send frames when the processor has finished the work for them."""
        if self.config.framing is Framing.RTNO:
            self._unsent += b"".join(map(encode_packet, frames))
        else:
            self._unsent += b"".join(frame.encode(self.config.checksum) for frame in frames)
        busy_us = calls * self.inputs["callback_ms"] * 1_000
        if self.inputs["slow_answer"]:
            busy_us += self.config.slow_answer_us
        self._free_us = now_us + busy_us if busy_us else 0
