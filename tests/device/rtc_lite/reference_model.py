"""A second node, naive, written from the text of the specification alone.

It shares no code with the device: one class, one loop over bytes, time as an
argument. It plays the echo component with ports `in` and `out` of type `l`,
whose callbacks fail as told.
"""

from __future__ import annotations

HEADER = 0x0A
NO_ARGUMENTS = {"CI", "CZ", "CX", "CF", "AA", "AD", "AE", "AB", "AC", "AR", "AS", "AH", "BB"}


def checked(text: str, data: bytes = b"") -> bytes:
    body = text.encode("ascii") + data
    return bytes([HEADER]) + body + bytes([sum(body) % 256])


class ReferenceNode:
    """What section 3, 4 and 5 of the digest say, in their order.

    Attributes:
        state: C, I, A, E or N.
        failing: callbacks that return an error.
        called: callbacks that ran.
    """

    def __init__(self, timer_hz: int = 0) -> None:
        self.timer_hz = timer_hz  # 0: the proxy executes (21h)
        self.state = "C"
        self.failing: set[str] = set()
        self.called: list[str] = []
        self.in_value = self.out_value = bytes(4)
        self.in_new = self.out_new = False
        self.frame = b""
        self.thrown_away = False
        self.last_byte_us = 0
        self.period_start_us = -1
        self.periods = 0

    def tick(self, now_us: int, received: bytes) -> bytes:
        sent = b""
        if self.frame and now_us - self.last_byte_us >= 100_000:
            self.frame = b""
            sent += checked("FK", b"\x01")
        if received:
            if now_us - self.last_byte_us >= 20_000:
                self.thrown_away = False
            self.last_byte_us = now_us
        for byte in received:
            sent += self.hear(byte)
            self.watch_timer(now_us)
        return sent + self.run_timer(now_us)

    # The parser: it counts what is still missing.

    def hear(self, byte: int) -> bytes:
        if self.thrown_away or (not self.frame and byte != HEADER):
            return b""
        self.frame += bytes([byte])
        if len(self.frame) < 3:
            return b""
        missing = self.missing()
        if missing is None:
            self.frame, self.thrown_away = b"", True
            return checked("FU", b"\x41")
        if missing > 0:
            return b""
        frame, self.frame = self.frame, b""
        if sum(frame[1:-1]) % 256 != frame[-1]:
            return checked("FH", b"\x03")
        return self.answer(frame[1:3].decode("ascii"), frame[3:-1])

    def missing(self) -> int | None:
        """Bytes that are still to come; None if that cannot be known, or is too much."""
        have, text = len(self.frame) - 3, self.frame[1:3].decode("latin-1")
        if text in NO_ARGUMENTS:
            size = 0
        elif text == "CY":
            size = 1
        elif text == "BW":
            size = 2
        elif text == "QG":
            if have == 0:
                return 1
            size = 1 + self.frame[3]
        elif text == "PS":
            if have < 2:
                return 1
            size = 2 + self.frame[3] + self.frame[4]
        else:
            return None if have == 1 else 1
        return None if size > 60 else size + 1 - have

    # The requests.

    def answer(self, text: str, data: bytes) -> bytes:  # noqa: PLR0911 - a row of the table each
        state = self.state.encode("ascii")
        match text:
            case "CX":
                return checked(text, b"@" + state)
            case "CY":
                return checked(text, b"@" + data)
            case "CZ":
                return (
                    checked("PP", b"\x03lin")
                    + checked("QQ", b"\x04lout")
                    + checked("CZ", b"@\x01\x01\x05Echo0")
                )
            case "BB":
                return checked(text, b"@\x22" if self.timer_hz else b"@\x21")
            case "BW":
                return checked(text, self.set_rate(data[0] + 256 * data[1]))
            case "PS":
                return checked(text, self.write(data))
            case "QG":
                return checked(text, self.poll(data[1:]))
            case "AE" | "AC" if self.timer_hz:
                return checked(text, b"!")
            case "AE":
                status = self.act("A", "on_execute", "A", "E")
                pushed = b"" if status == b"H" else self.pushed()
                return pushed + checked(text, status + self.state.encode("ascii"))
            case _:
                status = self.live(text)
                return checked(text, status + self.state.encode("ascii"))

    def live(self, text: str) -> bytes:  # noqa: PLR0911 - a row of the table each
        match text:
            case "CI":
                return self.act("C", "on_initialize", "I", "C")
            case "CF":
                return self.act("I", "on_finalize", "N", "I")
            case "AA":
                return self.act("I", "on_activated", "A", "E")
            case "AD":
                return self.act("A", "on_deactivated", "I", "E")
            case "AC":
                return self.act("E", "on_error", "E", "E")
            case "AR":
                return self.act("E", "on_reset", "I", "E")
            case "AB":
                if self.state != "A":
                    return b"H"
                self.call("on_deactivated")
                self.call("on_aborting")
                self.state = "E"
                return b"@"
            case _:  # AS, AH
                if self.state in "CN":
                    return b"H"
                return b"@" if self.call("on_startup" if text == "AS" else "on_shutdown") else b"x"

    def act(self, wanted: str, callback: str, good: str, bad: str) -> bytes:
        if self.state != wanted:
            return b"H"
        if self.call(callback):
            self.state = good
            return b"@"
        if bad == "E" and wanted != "E":
            if callback != "on_deactivated":
                self.call("on_deactivated")
            self.call("on_aborting")
        self.state = bad
        return b"x"

    def call(self, callback: str) -> bool:
        self.called.append(callback)
        if callback in self.failing:
            return False
        if callback == "on_execute" and self.in_new:
            self.out_value, self.out_new, self.in_new = self.in_value, True, False
        return True

    # The ports.

    def write(self, data: bytes) -> bytes:
        name, value = data[2 : 2 + data[0]], data[2 + data[0] :]
        if name != b"in":
            return b"F"
        if len(value) != 4:
            return b"!"
        self.in_value, self.in_new = value, True
        return b"@"

    def poll(self, name: bytes) -> bytes:
        if name != b"out":
            return b"D"
        if not self.out_new:
            return b"I"
        self.out_new = False
        return b"@\x04" + self.out_value

    def pushed(self) -> bytes:
        if not self.out_new:
            return b""
        self.out_new = False
        return checked("QV", b"\x03\x04out" + self.out_value)

    # The timer of the device.

    def set_rate(self, rate_hz: int) -> bytes:
        if not self.timer_hz or not 1 <= rate_hz <= 1000:
            return b"!"
        self.timer_hz = rate_hz
        self.period_start_us = -1
        return b"@"

    def watch_timer(self, now_us: int) -> None:
        if not self.timer_hz or self.state not in "AE":
            self.period_start_us = -1
        elif self.period_start_us < 0:
            self.period_start_us, self.periods = now_us, 0

    def run_timer(self, now_us: int) -> bytes:
        if self.period_start_us < 0:
            return b""
        ended = (now_us - self.period_start_us) * self.timer_hz // 1_000_000
        if ended <= self.periods:
            return b""
        self.periods = ended
        if self.state == "A":
            self.act("A", "on_execute", "A", "E")
        else:
            self.act("E", "on_error", "E", "E")
        return self.pushed()
