"""The master of the stirrer: CANopen on python-can, written by somebody who is not us."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import can

from boiler import planted

NODE = 5
TIMEOUT_S = 0.2
LOST_S = 0.35
"""Longer than three heartbeats."""

TPDO2 = 0x1801
ANGLE_COB_ID = 0x2A5
"""Where we want the angle; the unit has 285h."""


class SdoError(Exception):
    """A transfer failed."""


class Master:
    """Leads one motor, in one thread: `turn` is called again and again.

    Args:
        bus: of python-can.
        on_failure: called once the motor has told that it failed.

    Attributes:
        boots: boot-ups that were heard.
        angle: the latest angle of the shaft, per 32767 of 180 degrees; None before the first.
        failed: emergency error code of the motor, 0 while all is well.
    """

    def __init__(self, bus: can.BusABC, on_failure: Callable[[], None]) -> None:
        self._bus, self._on_failure = bus, on_failure
        self.boots, self.failed = 0, 0
        self.angle: int | None = None
        self._heard_s = time.monotonic()
        self._answers: list[bytes] = []

    def turn(self, timeout_s: float = 0.01) -> bool:
        """Take one frame, if it comes in time; return whether one came."""
        if (message := self._bus.recv(timeout_s)) is None:
            return False
        data = bytes(message.data)
        listen = 0x280 + NODE if planted("wrong COB-ID") else ANGLE_COB_ID
        match message.arbitration_id:
            case 0x705:
                self.boots += data == b"\0"
                self._heard_s = time.monotonic()
            case 0x585:
                self._answers.append(data)
            case 0x085 if not planted("EMCY not handled"):
                self._fail(int.from_bytes(data[:2], "little"))
            case cob_id if cob_id == listen:
                self.angle = int.from_bytes(data[:2], "little", signed=True)
        return True

    def start(self) -> None:
        """Bring the motor to Operational, whether its boot-up was heard or not."""
        until_s = time.monotonic() + 1.0
        while not self.boots and time.monotonic() < until_s:
            self.turn()
        if not self.boots and planted("boot-up lost"):
            raise SdoError("the motor does not boot")
        self._set_up()

    def watch(self) -> None:
        """Look whether the motor is still there; if it restarts, set it up again."""
        while self.turn():
            continue  # what has waited comes first
        if time.monotonic() - self._heard_s > LOST_S:
            self._recover()

    def read(self, index: int, sub: int = 0) -> bytes:
        """Read an object, in segments if it is long."""
        place = _multiplexer(index, sub)
        answer = self._ask(
            bytes([0x40]) + place + bytes(4),
            lambda data: data[0] >> 5 == 2 and data[1:4] == place,
        )
        if answer[0] & 0x02:
            return answer[4 : 8 - (answer[0] >> 2 & 3)]
        return self._segments()

    def write(self, index: int, sub: int, value: int, size: int) -> None:
        """Write a number of up to four bytes."""
        place = _multiplexer(index, sub)
        command = bytes([0x23 | (4 - size) << 2]) + place
        self._ask(command + value.to_bytes(4, "little"), lambda data: data[:4] == b"\x60" + place)

    def _segments(self) -> bytes:
        data, toggle = b"", 0
        while True:
            answer = self._ask(bytes([0x60 | toggle]) + bytes(7), partial(_is_segment, toggle))
            data += answer[1 : 8 - (answer[0] >> 1 & 7)]
            if answer[0] & 1:
                return data
            toggle ^= 0x10

    def _ask(self, request: bytes, fits: Callable[[bytes], bool]) -> bytes:
        """Send a request, and return the first answer that fits."""
        self._answers.clear()  # what came late is of another question
        self._send(0x605, request)
        until_s = time.monotonic() + TIMEOUT_S
        while time.monotonic() < until_s:
            self.turn()
            while self._answers:
                answer = self._answers.pop(0)
                if answer[0] == 0x80:
                    raise SdoError(f"aborted: {answer.hex()}")
                if fits(answer):
                    return answer
        raise SdoError(f"no answer in {TIMEOUT_S} s to {request.hex()}")

    def _set_up(self) -> None:
        self.write(0x1017, 0, 100, 2)
        self.write(TPDO2, 1, 0x8000_0000 | ANGLE_COB_ID, 4)
        self.write(TPDO2, 1, ANGLE_COB_ID, 4)
        self.write(TPDO2, 5, 50, 2)
        self._send(0x000, bytes([0x01, NODE]))

    def _recover(self) -> None:
        """Wait for the boot-up of a motor that went away, and set it up."""
        if planted("restart race"):
            time.sleep(0.05)
        else:
            boots, until_s = self.boots, time.monotonic() + 5.0
            while self.boots == boots and time.monotonic() < until_s:
                self.turn()
        self._set_up()
        self._heard_s = time.monotonic()

    def _fail(self, code: int) -> None:
        known, self.failed = self.failed, code
        if code not in (0, known):  # the same may come a hundred times on a bad line
            self._on_failure()

    def _send(self, cob_id: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))


def _multiplexer(index: int, sub: int) -> bytes:
    return index.to_bytes(2, "little") + bytes([sub])


def _is_segment(toggle: int, data: bytes) -> bool:
    right = data[0] & 0x10 == toggle or planted("toggle ignored")
    return data[0] >> 5 == 0 and right
