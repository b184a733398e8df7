"""A device that bytes of chance are thrown at, each time from the same snapshot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.physical import InputSignal
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.commands.device_type import DEVICES, DeviceType
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.fuzz.input_reader import FuzzAct, InputReader
from tickrig.emulators.testing.fuzz.shortened import shortened
from tickrig.emulators.testing.fuzz.words import Word, check_words
from tickrig.emulators.testing.properties.contract import check_period
from tickrig.wire.can import CanFrame

LOOKS: Final = 60
"""So often a device that shall answer is asked, at ever longer intervals: 92 s in all."""

LOOK_US: Final = 10_000


class SilentDeviceError(AssertionError):
    """A device did not answer any more."""


class DeviceFuzz:
    r"""A device on its wire, a host that sends what bytes mean, and the world that acts on it.

    Called with bytes, it puts the device back to what it was at the start, does what they mean,
    puts all inputs back, and asks the device until it answers. So each call is a run by itself,
    for a fuzzer or for bytes of chance.

    Args:
        device: its type, or the name of one; or what makes the device.
        words: what it understands, whole lines or frames (`605#40...`); they are sent as they
            are, spoilt, and in any order, with noise between.
        start: what it hears first, 10 ms each, so that it is at work.
        request: what is sent after each throw until the device answers, word after word; the first
            begins with LF where a line of noise has to be ended. Nothing is asked if empty.
        answer: what is in the bytes that come then; of a frame its beginning.
        wire: makes what it is on; that of its type, `CanWire` for a slave, unless given.
        warm_us: how long it runs before `start`, in microseconds.

    Raises:
        ValueError: words are no list of bytes or frames, or an answer is wanted to nothing.
        SilentDeviceError: when called: it does not answer.

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
        self._reader = InputReader(
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
        """Do what bytes mean; raise what the device raises, or that it is silent.

        Raises:
            SilentDeviceError: it does not answer.
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
        """Return whether acts end with an error of this type."""
        try:
            self._run(acts)
        except Exception as error:
            return type(error) is wanted
        return False

    def _check_words(
        self, words: object, start: object, request: Sequence[Word], answer: Word
    ) -> None:
        """Raise ValueError unless all are of the wire of the device."""
        for name, given in (("words", words), ("start", start), ("request", request)):
            check_words(name, given, self._on_can)
        if answer and not request:
            raise ValueError("answer without request: nothing is asked")
        if request and not answer:
            raise ValueError("request without answer: what is in the bytes that come then?")
        if answer:
            check_words("answer", [answer], self._on_can)

    def acts(self, data: bytes) -> list[FuzzAct]:
        """Return what bytes mean.

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
        """Put all inputs back and ask, until it answers."""
        if self._inputs:
            _put_back(self._inputs.table, self._inputs)
        if not self._request:
            self.rig.run_for(LOOKS * self.device.tick_us)
            return
        received: Any = b""
        for look in range(LOOKS):
            for word in self._request:
                self._send(word)
                received = self._received((look + 1) * LOOK_US) or received
                if self._is_answer(received):
                    return
        asked = ", ".join(str(word) if self._on_can else repr(word) for word in self._request)
        frames = " ".join(map(str, received)) or "nothing"
        said = frames if self._on_can else repr(received)
        raise SilentDeviceError(f"asked {asked} it says {said}, without {self._answer!r}")

    def _received(self, step_us: int) -> Any:
        """Return what comes within five steps, at the latest what has the answer in it."""
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
    """Return what the world does to a device; None if it does nothing."""
    if isinstance(device, CanopenSlave):
        return Application.of(device).inputs
    return getattr(device, "inputs", None)
