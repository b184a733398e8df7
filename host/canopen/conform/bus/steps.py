"""Execution of the steps of a check on the bus."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, Protocol

from tickrig.host.canopen.conform import check
from tickrig.host.canopen.conform.bus.exchange import (
    MS_US,
    BusExchange,
    Disturbed,
    NotAllowed,
    StepFailed,
)
from tickrig.host.canopen.conform.bus.frame_pattern import codes_text
from tickrig.host.canopen.conform.bus.macros import MACROS
from tickrig.host.canopen.conform.bus.sdo import SdoFrames
from tickrig.host.canopen.errors import SdoAborted, SdoMisnamed, SdoTimeout
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.sdo_frame import describe_abort

_REMOTE: Final = re.compile(r"^(\w+?)R(?=\d$)")
_POWER_OFF_MS: Final = 200


class StepPlayer:
    """Player that executes the steps of a conformance check on the bus, one after the other.

    The names in the steps must already be replaced by objects and values of the node.

    Args:
        exchange: bus with the node.
        node_id: node-ID of the node, 1..127.
        stimulus: function that operates the inputs of the device, or None if the user gave no
            stimulus.
        client: SDO client for the steps `Hold` and `RefuseRewrite`. For the other SDO steps, the
            player checks each frame.
    """

    def __init__(
        self, exchange: BusExchange, node_id: int, stimulus: check.Stimulus | None, client: _Client
    ) -> None:
        self._exchange, self._stimulus, self._client = exchange, stimulus, client
        self._sdo = SdoFrames(exchange, node_id)

    def play(self, step: check.Step) -> None:
        """Execute one step of a check.

        Raises:
            StepFailed: the node does not react as the step requires.
        """
        action, bus = step.action, self._exchange
        match action:
            case check.OfObject():
                self._play_sdo(action)
            case check.Send(text, extended):
                frame = CanFrame.parse(_REMOTE.sub(r"\1#R", text))
                bus.send(frame._replace(extended=frame.extended or extended))
            case check.Expect(patterns, within_ms):
                bus.expect(patterns, within_ms)
            case check.ExpectNone(can_id, for_ms):
                bus.none(can_id, for_ms)
            case check.Count(pattern, for_ms, least, most):
                bus.count(pattern, for_ms, least, most)
            case check.Period(pattern, each_ms, times):
                bus.period(pattern, each_ms, times)
            case check.Wait(for_ms):
                bus.wait(for_ms)
            case check.Forget(can_id):
                bus.forget(can_id)
            case check.Act(words, int(within_ms)):
                self._act_within(within_ms, *words)
            case check.Act(words):
                self._act(*words)
            case check.Macro(name, words):
                MACROS[name](self._sdo, *words)

    def _play_sdo(self, action: check.OfObject) -> None:
        sdo, at = self._sdo, action.address
        match action:
            case check.RefuseRead(_, codes):
                sdo.refuse_read(at, codes)
            case check.Hold() | check.RefuseRewrite():
                play_of_object(self._client, action)
            case check.Write(_, data):
                sdo.write(at, bytes.fromhex(data))
            case check.RefuseWrite(_, data, codes):
                sdo.refuse_write(at, bytes.fromhex(data), codes)
            case check.Read(_, data):
                sdo.read(at, data)
            case check.ReadOther(_, data):
                sdo.read_other(at, data)
            case check.Keep():
                pass  # the object that it names is written back at the end
            case _:
                raise AssertionError(action)

    def _act_within(self, within_ms: int, *words: str) -> None:
        """Run the stimulus. Raise Disturbed if the stimulus took longer than the check allows."""
        start_us = self._exchange.now_us
        self._act(*words)
        took_ms = (self._exchange.now_us - start_us) // MS_US
        if took_ms > within_ms:
            text = " ".join(words)
            raise Disturbed(f"{text} took {took_ms} ms, which is more than {within_ms} ms")

    def _act(self, *words: str) -> None:
        """Operate the inputs of the device, or compare its outputs."""
        match words:
            case ("power-cycle",):
                self._act("power", "off")
                self._exchange.wait(_POWER_OFF_MS)
                self._exchange.forget_all()
                self._act("power", "on")
            case ("expect", name, wanted):
                got = self._stimulate("output", name)
                if _value(got) != _value(wanted):
                    raise StepFailed(f"output {name} is {got}, want {wanted}")
            case _:
                self._stimulate(*words)

    def _stimulate(self, *words: str) -> str:
        if self._stimulus is None:
            raise Disturbed("there is no stimulus for the inputs")
        self._exchange.remark(" ".join(words))
        try:
            return self._stimulus(*words)
        except ValueError as error:
            raise NotAllowed(f"the stimulus cannot do {' '.join(words)}: {error}") from error
        finally:
            self._exchange.excuse()


def _value(text: str) -> float | str:
    """Read a number in any notation. Return other texts unchanged."""
    try:
        return float(text)
    except ValueError:
        return text


# The steps that only object checks have: read a value, and write it back with a wrong size.


class _Client(Protocol):
    """A client that reads and writes objects of the node under test."""

    def upload(self, index: int, sub: int, /) -> bytes:
        """Read an object. The errors are SdoAborted, SdoMisnamed and SdoTimeout."""
        ...

    def download(self, index: int, sub: int, data: bytes, /) -> None:
        """Write an object. The errors are SdoAborted, SdoMisnamed and SdoTimeout."""


def play_of_object(client: _Client, action: check.Hold | check.RefuseRewrite) -> None:
    """Execute a step of a check about one object of the EDS, such as reading its value.

    Raises:
        StepFailed: the node does not react as the step requires.
    """
    try:
        if isinstance(action, check.Hold):
            _play_hold(client, action)
        else:
            _rewrite(client, *action.address, action.grow, action.codes)
    except (SdoMisnamed, SdoTimeout) as error:
        raise StepFailed(str(error)) from error


def _play_hold(client: _Client, step: check.Hold) -> None:
    try:
        data = client.upload(*step.address)
    except SdoAborted as error:
        if f"{error.code:08X}" in step.codes:
            return
        raise StepFailed(f"refused with {describe_abort(error.code)}, want its value") from error
    kind = DataType[step.kind]
    if kind.size and len(data) != kind.size:
        raise StepFailed(f"{len(data)} bytes, want {kind.size} of {kind.name}: {data.hex()}")
    if step.value is not None and data.hex().upper() != step.value:
        raise StepFailed(f"holds {data.hex().upper()}, want {step.value}")
    _check_limits(kind, data, step)


def _check_limits(kind: DataType, data: bytes, step: check.Hold) -> None:
    value = kind.decode(data)
    if not isinstance(value, int | float):
        return
    if step.low is not None and value < step.low:
        raise StepFailed(f"{value} is below its lower limit {step.low}")
    if step.high is not None and value > step.high:
        raise StepFailed(f"{value} is above its upper limit {step.high}")


def _rewrite(client: _Client, index: int, sub: int, grow: int, codes: Sequence[str]) -> None:
    wanted = f"abort {codes_text(codes)}"
    try:
        data = client.upload(index, sub)
    except SdoAborted:
        return  # its value cannot be written; which value it should have is another check
    data = data[:grow] if grow < 0 else data + bytes(grow)
    try:
        client.download(index, sub, data)
    except SdoAborted as error:
        if f"{error.code:08X}" not in codes:
            text = f"{len(data)} bytes refused with {describe_abort(error.code)}, want {wanted}"
            raise StepFailed(text) from error
    else:
        raise StepFailed(f"{len(data)} bytes were accepted, want {wanted}")
