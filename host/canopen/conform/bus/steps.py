"""What each step of a check does on the bus."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.notation.step_text import ANSWER_MS
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.sdo.sdo_command import EXPEDITED_BYTES

Stimulus = Callable[..., str]
"""What moves the inputs of the device: takes words, returns what it answers."""

REMOTE: Final = re.compile(r"^(\w+?)R(?=\d$)")


class Player:
    """Plays bound steps.

    Args:
        exchange: the bus.
        node_id: of the node.
        stimulus: for steps that need the hand of the application.
    """

    def __init__(self, exchange: Exchange, node_id: int, stimulus: Stimulus | None) -> None:
        self._exchange, self._stimulus = exchange, stimulus
        self._request, self._response = f"{0x600 + node_id:03X}", f"{0x580 + node_id:03X}"

    def play(self, step: Mapping[str, Any]) -> None:
        """Do one step; StepFailed if the node does not do as it says."""
        bus = self._exchange
        match step:
            case {"send": text}:
                frame = CanFrame.parse(REMOTE.sub(r"\1#R", text))
                bus.send(frame._replace(extended=frame.extended or step.get("ext", False)))
            case {"expect": patterns, "in": within_ms}:
                bus.expect(patterns, within_ms)
            case {"none": can_id, "for": for_ms}:
                bus.none(can_id, for_ms)
            case {"count": pattern, "for": for_ms, "min": least, "max": most}:
                bus.count(pattern, for_ms, least, most)
            case {"wait": for_ms}:
                bus.wait(for_ms)
            case {"forget": can_id}:
                bus.unread(can_id).clear()
            case _:
                self._play_sdo(step)

    def _play_sdo(self, step: Mapping[str, Any]) -> None:
        match step:
            case {"write": (index, sub), "data": data}:
                self._download(index, sub, data)
                self._answer(f"60{_multiplexer(index, sub)}00000000")
            case {"refuse write": (index, sub), "data": data, "codes": codes}:
                self._download(index, sub, data)
                self._answer(*_aborts(index, sub, codes))
            case {"read": (index, sub), "data": data}:
                self._upload(index, sub)
                self._answer(f"{_command(data, 0x43)}{_multiplexer(index, sub)}{data:.<8}")
            case {"refuse read": (index, sub), "codes": codes}:
                self._upload(index, sub)
                self._answer(*_aborts(index, sub, codes))
            case _:
                raise ValueError(f"unknown step {step}")

    def _download(self, index: int, sub: int, data: str) -> None:
        self._say(f"{_command(data, 0x23)}{_multiplexer(index, sub)}{data:0<8}")

    def _upload(self, index: int, sub: int) -> None:
        self._say(f"40{_multiplexer(index, sub)}00000000")

    def _say(self, data: str) -> None:
        self._exchange.send(CanFrame.parse(f"{self._request}#{data}"))

    def _answer(self, *data: str) -> str:
        patterns = [f"{self._response}#{pattern}" for pattern in data]
        return self._exchange.expect(patterns, ANSWER_MS)


def _aborts(index: int, sub: int, codes: list[str]) -> list[str]:
    at = _multiplexer(index, sub)
    return [f"80{at}{bytes.fromhex(code)[::-1].hex().upper()}" for code in codes]


def _command(data: str, command: int) -> str:
    """Return the command byte of expedited data: how many bytes are unused."""
    return f"{command | (EXPEDITED_BYTES - len(data) // 2) << 2:02X}"


def _multiplexer(index: int, sub: int) -> str:
    return f"{index & 0xFF:02X}{index >> 8:02X}{sub:02X}"
