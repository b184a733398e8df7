"""Fuzzing of devices: random bytes select what a host sends and which inputs change.

Each run starts from the same snapshot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

from tickrig.device.canopen.slave import Application, CanopenSlave
from tickrig.device.physical import InputSignal, SignalType
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.commands.device_type import DEVICES, DeviceType
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties.contract import check_period
from tickrig.emulators.testing.properties.device_bench import shortened
from tickrig.wire.can import CanFrame

# The acts on a device, as a user writes them.

Word = bytes | str
"""Bytes of a serial line, or a frame in candump's notation."""


def _check_words(name: str, words: object, on_can: bool) -> None:
    """Check that words are a list of items that a device on a wire can receive.

    Args:
        name: name of the words in messages.
        words: the value that the user passed.
        on_can: whether the device is on a CAN bus.

    Raises:
        ValueError: the words are not such a list.
    """
    if isinstance(words, str | bytes) or not isinstance(words, list | tuple):
        example = "'705#7F'" if on_can else "b'ON\\\\n'"
        raise ValueError(f"{name}: a list, as [{example}], got {words!r:.60}")
    for word in words:
        if not isinstance(word, str | bytes):
            raise ValueError(f"{name}: bytes, or a frame as '705#7F', got {word!r:.60}")
        if isinstance(word, str) is not on_can:
            wanted = "on CAN: a frame as '705#7F'" if on_can else "on a line: bytes"
            raise ValueError(f"{name}: this device is {wanted}, got {word!r:.60}")


# What bytes mean as acts: lines or frames, noise, changed inputs, pauses, power cuts.

_SENDS: Final = 160
_SPOILS: Final = 200
_NOISES: Final = 224
_SETS: Final = 252
"""Limits of the first byte of an act. A byte below the first limit sends a word. A byte below the
second limit sends a corrupted word. A byte below the third limit sends noise. A byte below the last
limit changes an input. From the last limit on, the act is a reset."""

_MOST_NOISE: Final = 24
_MOST_ACTS: Final = 40


class FuzzAct(NamedTuple):
    """One action of a fuzzing run on an emulated device.

    Attributes:
        verb: type of the action: `send`, `set` or `reset`.
        what: bytes or a frame for `send`, the name of an input and its value for `set`, or None for
            `reset`.
        wait_us: pause after the action, in microseconds.
    """

    verb: str
    what: Any
    wait_us: int

    def __str__(self) -> str:
        """Return the action as text.

        >>> str(FuzzAct("send", b"on", 500)), str(FuzzAct("set", ("stick", 3), 0))
        ('send on, wait 500 us', 'set stick 3, wait 0 us')
        """
        what = self.what
        if isinstance(what, tuple):
            what = " ".join(map(str, what))
        text = repr(what)[2:-1] if isinstance(what, bytes) else "" if what is None else str(what)
        return f"{self.verb} {text}".rstrip() + f", wait {self.wait_us} us"


class _InputReader:
    """Decodes any bytes into acts.

    A small change that a fuzzer makes to the bytes changes the acts only a little.

    Args:
        words: words that the device understands: bytes, or frames.
        inputs: the inputs of the device that may change.
        tick_us: period of the device.
        on_can: whether words are frames.
    """

    def __init__(
        self,
        words: Sequence[bytes | CanFrame],
        inputs: Sequence[InputSignal],
        tick_us: int,
        on_can: bool,
    ) -> None:
        self._words, self._on_can = words, on_can
        self._inputs = [item for item in inputs if item.type is not SignalType.TEXT]
        self._waits = (0, tick_us // 2, tick_us, tick_us, 2 * tick_us, 5 * tick_us, 20_000, 100_000)

    def acts(self, data: bytes) -> Iterator[FuzzAct]:
        """Yield the actions that bytes encode; incomplete data at the end are ignored."""
        rest = iter(data)
        try:
            for _ in range(_MOST_ACTS):
                yield self._act(next(rest), next(rest), rest)
        except StopIteration:
            return

    def _act(self, op: int, timing: int, rest: Iterator[int]) -> FuzzAct:
        wait_us = self._waits[timing & 7]
        if op < _SENDS and self._words:
            return FuzzAct("send", self._word(op, timing, rest), wait_us)
        if op < _SPOILS and self._words:
            return FuzzAct("send", self._spoilt(self._word(op, timing, rest), rest), wait_us)
        if op < _NOISES or (op < _SETS and not self._inputs):
            return FuzzAct("send", self._noise(op, rest), wait_us)
        if op < _SETS:
            return FuzzAct("set", self._change(rest), wait_us)
        return FuzzAct("reset", None, wait_us)

    def _word(self, op: int, timing: int, rest: Iterator[int]) -> bytes | CanFrame:
        number = next(rest) | (timing >> 3) << 8
        return self._words[number % len(self._words)]

    def _spoilt(self, word: bytes | CanFrame, rest: Iterator[int]) -> bytes | CanFrame:
        if isinstance(word, CanFrame):
            data = _spoilt_bytes(word.data, rest)[:8]
            return CanFrame(word.can_id, data, word.remote, word.extended, word.remote_length)
        return _spoilt_bytes(word, rest)

    def _noise(self, op: int, rest: Iterator[int]) -> bytes | CanFrame:
        length = next(rest) % _MOST_NOISE
        if not self._on_can:
            return bytes([next(rest) for _ in range(length + 1)])
        can_id = next(rest) | (op & 7) << 8
        return CanFrame(can_id, bytes([next(rest) for _ in range(length % 9)]))

    def _change(self, rest: Iterator[int]) -> tuple[str, float]:
        item = self._inputs[next(rest) % len(self._inputs)]
        share = next(rest)
        if item.high - item.low <= 1 and not item.real:
            return item.name, item.low + share % (round(item.high - item.low) + 1)
        value = item.low + (item.high - item.low) * share / 255
        return item.name, value if item.real else round(value)


def _spoilt_bytes(word: bytes, rest: Iterator[int]) -> bytes:
    """Return a corrupted word: a byte is changed, added or removed, or the word ends early."""
    at, value, how = next(rest) % (len(word) + 1), next(rest), next(rest) % 4
    if how == 0:
        return word[:at] + bytes([value]) + word[at + 1 :]
    if how == 1:
        return word[:at] + bytes([value]) + word[at:]
    return word[:at] + (word[at + 1 :] if how == 2 else b"")


# A device that bytes of chance are thrown at, each time from the same snapshot.

_LOOKS: Final = 60
"""Number of checks for an answer of the device, at increasing intervals that are 92 s in all."""

_LOOK_US: Final = 10_000


class SilentDeviceError(AssertionError):
    """A device did not answer any more."""

    __module__ = "tickrig.testing"


class DeviceFuzz:
    r"""A device on its wire, with a host and inputs that random bytes control.

    A call takes bytes. It restores the device to its state at the start and executes the acts that
    the bytes encode. Then it restores all inputs and sends the request until the device answers.
    Each call is therefore independent of earlier ones, whether the bytes come from a fuzzer or from
    a random generator.

    Args:
        device: device type or the name of a type, or a callable that makes the device.
        words: words that the device understands, as whole lines or frames (`605#40...`). The words
            are sent unchanged or corrupted, in any order, with noise between them.
        start: traffic that the device receives first, one item every 10 ms, to bring the device
            into operation.
        request: words that are sent after each run, one after the other, until the device answers.
            The first word begins with LF if it has to end a line of noise. If `request` is empty,
            no answer is expected.
        answer: text that the bytes of the answer contain, or the beginning of a frame of the
            answer.
        wire: function that makes the wire of the device. The default is the wire of the device
            type, or `CanWire` for a slave.
        warm_us: time for which the device runs before `start`, in microseconds.

    Raises:
        ValueError: the words are not a list of bytes or frames, or there is an answer without a
            request.
        SilentDeviceError: the device does not answer. A call of the object raises this exception.

    >>> fuzz = DeviceFuzz("rrc", [b"hello\n"], request=[b"\ndevice\n"], answer=b"RRC\n")
    >>> fuzz(bytes(range(200)))
    """

    def __init__(  # noqa: PLR0913 - by name
        self,
        device: DeviceType | str | Callable[[], Any],
        words: Sequence[Word] = (),
        *,
        start: Sequence[Word] = (),
        request: Sequence[Word] = (),
        answer: Word = b"",
        wire: Callable[[], ByteLine | CanWire] | None = None,
        warm_us: int = 1_000_000,
    ) -> None:
        made = DEVICES.load(device) if isinstance(device, str) else device
        self.device: Any = made.build({}) if isinstance(made, DeviceType) else made()
        check_period(self.device)
        joined = _wire_of(self.device, made, wire)
        self._on_can = isinstance(joined, CanWire)
        self._check_words(words, start, request, answer)
        port, self._end = _ends(joined)
        self.rig = Rig(Station(self.device, port))
        self._inputs = _inputs_of(self.device)
        self._reader = _InputReader(
            [self._traffic(word) for word in words],
            list(self._inputs.table.values()) if self._inputs else [],
            self.device.tick_us,
            self._on_can,
        )
        self._request, self._answer = [self._traffic(word) for word in request], answer
        self.rig.run_for(warm_us)
        for word in start:
            self._send(self._traffic(word))
            self.rig.run_for(10_000)
        self._end.poll(self.rig.now_us)
        self._snapshot = self.rig.snapshot(self._end)

    def __call__(self, data: bytes) -> None:
        """Execute the acts that bytes encode; raise the exception of the device.

        Raises:
            SilentDeviceError: the device does not answer.
        """
        acts = self.acts(data)
        try:
            self._run(acts)
        except Exception as error:
            wanted = type(error)
            needed = shortened(acts, lambda fewer: self._fails_so(fewer, wanted))
            error.add_note("\n".join(["what was done:", *map(str, needed)]))
            raise

    def _run(self, acts: list[FuzzAct]) -> None:
        self._snapshot.restore()
        for act in acts:
            self._do(act)
        self._check_answer()

    def _fails_so(self, acts: list[FuzzAct], wanted: type[Exception]) -> bool:
        """Return whether acts end with an error of the wanted type."""
        try:
            self._run(acts)
        except Exception as error:
            return type(error) is wanted
        return False

    def _check_words(
        self, words: object, start: object, request: Sequence[Word], answer: Word
    ) -> None:
        """Raise ValueError unless the wire of the device can carry all words."""
        for name, given in (("words", words), ("start", start), ("request", request)):
            _check_words(name, given, self._on_can)
        if answer and not request:
            raise ValueError("answer without request: nothing is asked")
        if request and not answer:
            raise ValueError("request without answer: what is in the bytes that come then?")
        if answer:
            _check_words("answer", [answer], self._on_can)

    def acts(self, data: bytes) -> list[FuzzAct]:
        """Return the actions that bytes encode.

        Args:
            data: any bytes.
        """
        return list(self._reader.acts(data))

    def _traffic(self, word: Word) -> Any:
        return CanFrame.parse(word) if isinstance(word, str) else word

    def _send(self, what: Any) -> None:
        self._end.send(self.rig.now_us, (what,) if self._on_can else what)

    def _do(self, act: FuzzAct) -> None:
        if act.verb == "send":
            self._send(act.what)
        elif act.verb == "set":
            self._inputs.set(*act.what)
        else:
            self.device.reset()
        self.rig.run_for(act.wait_us)
        self._end.poll(self.rig.now_us)

    def _check_answer(self) -> None:
        """Restore all inputs, and send the request until the device answers."""
        if self._inputs:
            _put_back(self._inputs.table, self._inputs)
        if not self._request:
            self.rig.run_for(_LOOKS * self.device.tick_us)
            return
        received: Any = b""
        for look in range(_LOOKS):
            for word in self._request:
                self._send(word)
                received = self._received((look + 1) * _LOOK_US) or received
                if self._is_answer(received):
                    return
        asked = ", ".join(str(word) if self._on_can else repr(word) for word in self._request)
        frames = " ".join(map(str, received)) or "nothing"
        said = frames if self._on_can else repr(received)
        raise SilentDeviceError(f"asked {asked} it says {said}, without {self._answer!r}")

    def _received(self, step_us: int) -> Any:
        """Return the data received within five steps; stop early after the answer."""
        received: Any = () if self._on_can else b""
        for _ in range(5):
            self.rig.run_for(step_us)
            received += self._end.poll(self.rig.now_us)
            if self._is_answer(received):
                break
        return received

    def _is_answer(self, received: Any) -> bool:
        if not self._on_can:
            return self._answer in received
        return any(str(frame).startswith(str(self._answer)) for frame in received)


def _put_back(table: Mapping[str, InputSignal], inputs: Any) -> None:
    for name, item in table.items():
        if inputs[name] != item.initial:
            inputs.set(name, item.initial)


def _wire_of(
    device: Any, made: object, wire: Callable[[], ByteLine | CanWire] | None
) -> ByteLine | CanWire:
    if wire is not None:
        return wire()
    if isinstance(made, DeviceType):
        return made.line.wire(made.line.baud)
    return CanWire() if isinstance(device, CanopenSlave) else SerialLine()


def _ends(wire: ByteLine | CanWire) -> tuple[Any, Any]:
    return (wire.end(), wire.end()) if isinstance(wire, CanWire) else (wire.a, wire.b)


def _inputs_of(device: Any) -> Any:
    """Return the inputs of a device that fuzzing may change, or None if there are none."""
    if isinstance(device, CanopenSlave):
        return Application.of(device).inputs
    return getattr(device, "inputs", None)
