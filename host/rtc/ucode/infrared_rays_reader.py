"""InfraredRaysReader, which converts lines of an infra-red reader into ucodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, Final

from tickrig.host.links.link import Link
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc.component import ExecutionContext, ModuleSpec
from tickrig.host.rtc.device_component import DeviceComponent
from tickrig.host.rtc.ports.data_port import OutPort
from tickrig.host.text.log import log_of
from tickrig.wire.errors import WireError
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rtc_types.rtc import Time, TimedLongSeq, TimedStringSeq
from tickrig.wire.ucode import BAUD, LineType, UcodeLine, parse_line

# A host of an infra-red ucode reader that waits for nothing: look for rounds later.

_SILENCE_US: Final = 1_000_000
"""Longest time without a valid line, which is ten rounds."""


@dataclass(frozen=True, slots=True)
class Round:
    """The ucode markers that an infrared reader received in one round, a period of 100 ms.

    Attributes:
        number: number of the round in the counter of the reader, 0..65535.
        ucodes: received ucodes, each with its signal level in per cent. The nearest marker is
            first.
        blinded: whether too much light prevented the reception.
    """

    number: int
    ucodes: tuple[tuple[str, int], ...] = ()
    blinded: bool = False


class UcodeReaderClient:
    """Client for an infrared reader of ucode markers on a serial line.

    The client starts the reader and receives the result of each round. A round with a lost or
    garbled line is dropped. After each second without a valid line, the client starts the reader
    again. When the client is made, it discards the bytes that have already arrived, because the
    robot may have moved since then.

    Args:
        link: line to the reader.

    Raises:
        LinkClosed: the line is closed.

    Attributes:
        garbled: number of invalid lines.
        incomplete: number of rounds that were dropped.
        restarts: number of times that the reader was started again.
    """

    def __init__(self, link: Link[bytes]) -> None:
        self._link, self._lines = link, LineSplitter(256)
        self.garbled = self.incomplete = self.restarts = 0
        link.receive(0)
        self._begin()

    def poll(self) -> list[Round]:
        """Return the rounds that have arrived.

        Raises:
            LinkClosed: the line is closed.
        """
        rounds: list[Round] = []
        for raw in self._lines.push(self._link.receive(0)):
            try:
                line = parse_line(raw)
            except WireError:
                self.garbled += 1
            else:
                self._received_us = self._link.now_us
                rounds += self._take(line)
        if self._link.now_us - self._received_us > _SILENCE_US:
            self.restarts += 1
            self._begin()
        return rounds

    def close(self) -> None:
        """Stop listening, and release the line."""
        self._link.send(b"\nOFF\n")
        self._link.close()

    def _begin(self) -> None:
        self._received_us = self._link.now_us
        self._begun: list[UcodeLine] = []
        self._link.send(b"\nON\n")

    def _take(self, line: UcodeLine) -> list[Round]:
        match line:
            case UcodeLine(LineType.UCODE):
                self._begun.append(line)
            case UcodeLine(LineType.READER, (_, _, _, 0)):
                self._link.send(b"ON\n")
            case UcodeLine(LineType.LIGHT, (int(number),)):
                return self._ended(Round(number, blinded=True), 0)
            case UcodeLine(LineType.ROUND, (int(number), int(count))):
                return self._ended(self._round(number), count)
            case _:  # who it is, or that it did not understand
                pass
        return []

    def _round(self, number: int) -> Round:
        lines = [line.fields for line in self._begun if line.fields[0] == number]
        return Round(number, tuple((str(ucode), int(level)) for _, ucode, level in lines))

    def _ended(self, found: Round, count: int) -> list[Round]:
        whole = len(found.ucodes) == count == len(self._begun)
        self.incomplete += not whole
        self._begun = []
        return [found] if whole else []


_LOG: Final = log_of(__name__)

_OpenReader = Callable[[str], Link[bytes]]
OPEN_SERIAL: Final[_OpenReader] = partial(SerialLink, baud=BAUD)


class InfraredRaysReader(DeviceComponent[UcodeReaderClient]):
    """Component that runs an infrared reader while Active, and writes the ucodes of each round.

    The ports are `ucodes` (32 hex digits each, the nearest marker first, empty if no ucode was
    received) and `levels` (signal level of each ucode in per cent). If the reader sends nothing,
    the component starts it again each second. If the line is closed, the component moves to Error.
    The NEDO report (Fig. 123) only names the component. tickrig has added the ports and parameters.

    Args:
        instance_name: name of the component.
        open_link: function that opens the line. By default, it is opened by pyserial.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("InfraredRaysReader", "Ucodes of infra-red markers")

    def __init__(self, instance_name: str, open_link: _OpenReader = OPEN_SERIAL) -> None:
        super().__init__(instance_name)
        self.device = self.configuration.bind("DeviceFileName", "/dev/ttyUSB0")
        self.ucodes = self.add_port(OutPort("ucodes", TimedStringSeq))
        self.levels = self.add_port(OutPort("levels", TimedLongSeq))
        self._open_link = open_link
        self._was_silent = self._was_blinded = False

    def open_client(self) -> UcodeReaderClient:
        """Open the line, and start the reader."""
        self._was_silent = self._was_blinded = False
        return UcodeReaderClient(self._open_link(self.device.value))

    def exchange(self, ec: ExecutionContext, client: UcodeReaderClient) -> None:
        """Write the rounds that have arrived."""
        restarts = client.restarts
        rounds = client.poll()
        for received in rounds:
            self._write(Time.from_us(ec.now_us), received)
        self._watch(rounds, client.restarts > restarts)

    def _write(self, now: Time, received: Round) -> None:
        self.ucodes.write(TimedStringSeq(now, tuple(ucode for ucode, _ in received.ucodes)))
        self.levels.write(TimedLongSeq(now, tuple(level for _, level in received.ucodes)))

    def _watch(self, rounds: list[Round], silent: bool) -> None:
        """Log when the reader becomes silent or blinded, or when it works again."""
        if rounds:
            blinded = rounds[-1].blinded
            if blinded != self._was_blinded:
                what = "too much light: nothing is received" if blinded else "it receives again"
                _LOG.warning("%s: %s", self.instance_name, what)
            self._was_blinded = blinded
        if silent and not self._was_silent:
            _LOG.warning("%s: the reader is silent", self.instance_name)
        elif rounds and self._was_silent:
            _LOG.warning("%s: the reader is back", self.instance_name)
        self._was_silent = not rounds and (silent or self._was_silent)
