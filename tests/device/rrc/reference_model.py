"""Naive model of the RRC, written from the digest of its manual (decisions R1 to R28) alone.

It shares no code with the device: no table, no codec, no type. It is slow and plain on purpose,
counts in exact numbers where the digest gives real ones, and visits every tick of 10 ms.

Three readings are not forced by the digest; the model reads them as the device does: Initialize
does not look at the power button, so that a press in its tick is seen one tick later; what commands
set in its tick is wiped at its end; while the bus is unplugged, a power-on test sees no other
fault.
"""

import math
from fractions import Fraction
from functools import cache

DRIVING = ("Standby", "Limit", "Output")
HEX = b"0123456789ABCDEFabcdef"
NAMES = (
    *("limit", "output", "device", "version", "date", "speedmode", "joystick"),
    *("watchdog", "stablemode", "status", "poweroff", "beep"),
)
ANSWERS = {"device": "RRC", "version": "Version 1.0", "date": "Apr 30 2015 00:00:00"}
FAULTS = (
    ("bus_noise", "CommunicationError"),
    ("joystick_fault", "JoystickModuleError"),
    ("power_module_fault", "PowerModuleError"),
    ("vr2_fault", "SystemError"),
    ("bus_unplugged", "NoCommunication"),
)
INPUTS = {
    "rrc_power": 1,
    "power_button": 0,
    "alarm_button": 0,
    "speed_up_button": 0,
    "speed_down_button": 0,
    "stick_v_pct": 0,
    "stick_w_pct": 0,
    "gauge": 10,
    "bus_noise": 0,
    "joystick_fault": 0,
    "power_module_fault": 0,
    "vr2_fault": 0,
    "bus_unplugged": 0,
    "extra_load_pct": 0,
}


class CommandError(Exception):
    """A line that gets an ER reply; the text is what follows `ER:`."""


def check(message: bytes) -> str:
    """Return the CHECK digit of a message (2.1)."""
    return "0123456789ABCDEF"[sum(message) % 16]


@cache
def shape(value: int, low: int, high: int, exponent: int) -> int:
    """Return the shaped axis (R16), without floats.

    The largest `out` with (out - 0.5) / 100 <= s ** ((10 + exponent) / 10), both sides to the
    tenth power, which whole numbers decide.
    """
    size = abs(value)
    if size <= low:
        out = 0
    elif size >= high:
        out = 100
    else:
        part = 200**10 * (size - low) ** (10 + exponent)
        whole = (high - low) ** (10 + exponent)
        out = 0
        while (2 * out + 1) ** 10 * whole <= part:
            out += 1
    return out if value > 0 else -out


def limited(v: int, w: int, limits: list[int]) -> tuple[int, int]:
    """Return the stick within the five limits (R19)."""
    a = min(abs(v), limits[0])
    b = min(abs(w), limits[1])
    of_a = [a]
    of_b = [b]
    if a + b > limits[2]:
        of_a.append(a * limits[2] // (a + b))
        of_b.append(b * limits[2] // (a + b))
    if a * b > 100 * limits[3]:
        of_a.append(math.isqrt(100 * limits[3] * a // b))
        of_b.append(math.isqrt(100 * limits[3] * b // a))
    if a * a + b * b > limits[4] ** 2:
        of_a.append(math.isqrt(a * a * limits[4] ** 2 // (a * a + b * b)))
        of_b.append(math.isqrt(b * b * limits[4] ** 2 // (a * a + b * b)))
    a = min(of_a)
    b = min(of_b)
    return (a if v > 0 else -a), (b if w > 0 else -b)


def angle(v: int, w: int) -> Fraction:
    """Return the angle of the stick from straight back in degrees (5).

    A stick in whole percents has a rational angle at multiples of 45 degrees only; those are exact.
    """
    if abs(v) == abs(w):
        return Fraction(45 if v < 0 else 135)
    return Fraction(math.degrees(math.atan2(abs(w), -v)))


def numbers(digits: bytes, widths: list[int]) -> list[int]:
    """Return the hex numbers of these widths; ValueError if they are not exactly that."""
    if len(digits) != sum(widths):
        raise ValueError("parameter count")
    if any(digit not in HEX for digit in digits):
        raise ValueError("not a hex digit")
    found = []
    for width in widths:
        found.append(int(digits[:width], 16))
        digits = digits[width:]
    return found


def within(values: list[int], tops: list[int]) -> None:
    """Check that each value is at most its top."""
    if any(value > top for value, top in zip(values, tops, strict=True)):
        raise ValueError("range")


def twos_hex(value: int) -> str:
    """Return 8-bit two's complement in hex (R1, R2)."""
    return f"{value % 256:02X}"


class ReferenceRrc:
    """The RRC as the digest tells it; `tick` must be called for every tick, in order."""

    def __init__(self) -> None:
        self.cut_power()

    def cut_power(self) -> None:
        """Forget everything: the RRC has no power (S0)."""
        self.state = "Off"
        self.buffer = b""
        self.ignoring = False
        self.ignored = 0
        self.power_level = 0
        self.wipe()

    def wipe(self) -> None:
        """Reset what commands and buttons have set (S1, R5)."""
        self.speed_mode = 1
        self.locked = False
        self.stable = False
        self.watchdog_ticks = 0
        self.last_ok = 0
        self.status = False
        self.limits = [100, 100, 255, 255, 255]
        self.output = (0, 0)
        self.joystick = [0, 0, 100, 100, 0, 0, 0, 5, 30, 45]
        self.pattern: list[int] = []
        self.pattern_start = 0
        self.button_mode = -1
        self.counters = {"speed_up_button": 0, "speed_down_button": 0, "alarm_button": 0}
        self.gear = "N"
        self.gear_tick = 0
        self.neutral_ticks = 0
        self.backlog = 0
        self.costs = [0] * 10
        self.out_v = 0
        self.out_w = 0
        self.by_stick = False
        self.buzzer = 0
        self.trigger_tick = -1
        self.entry_tick = -1
        self.release_tick = -1
        self.fault_ticks = {name: 0 for name, _ in FAULTS}

    def tick(self, tick: int, rx: bytes, inputs: dict[str, int]) -> bytes:
        """Live one tick of 10 ms in the order of R28 and return what is sent."""
        if not inputs["rrc_power"]:
            self.cut_power()
            return b""
        if self.state == "Off":
            self.state = "Initialize"
        self.now = tick
        self.inputs = inputs
        self.sent: list[str] = []
        self.cost = 30 + inputs["extra_load_pct"]
        self.receive(rx)
        self.user_buttons()
        self.power_events()
        self.commands()
        self.watchdog()
        self.drive()
        self.status_line()
        self.account()
        self.sound()
        return "".join(line + "\n" for line in self.sent).encode("ascii")

    def reply(self, line: str) -> None:
        self.sent.append(line)
        self.cost += 15

    # received bytes

    def receive(self, rx: bytes) -> None:
        for byte in rx:
            if byte == 0x0A:
                self.cost += 25
            if self.ignoring:
                self.ignoring = byte != 0x0A
                if self.ignoring:
                    self.ignored += 1
                    if self.ignored % 256 == 0:
                        self.cost += 150
            elif len(self.buffer) == 256:
                self.buffer = b""
                self.ignoring = byte != 0x0A
                self.ignored = 0
                self.sent.append("ER:ReceiveBufferOverflow")
                self.cost += 150
            else:
                self.buffer += bytes([byte])

    # buttons of the user

    def user_buttons(self) -> None:
        if self.state not in DRIVING:
            return
        if self.pressed("speed_up_button") and not self.locked:
            self.speed_mode = min(self.speed_mode + 1, 5)
        if self.pressed("speed_down_button") and not self.locked:
            self.speed_mode = max(self.speed_mode - 1, 1)
        if self.pressed("alarm_button") and self.state == "Standby":
            mode = self.inputs["speed_down_button"] + 2 * self.inputs["speed_up_button"]
            if mode != self.button_mode:
                self.gear = "N"
            self.button_mode = mode

    def pressed(self, name: str) -> bool:
        if self.counters[name] % 2 == self.inputs[name]:
            return False
        self.counters[name] = (self.counters[name] + 1) % 16
        return self.counters[name] % 2 == 1

    # power events

    def power_events(self) -> None:
        if self.state == "Initialize":
            self.wipe()
            self.state = "WaitPowerOn"
            self.sent.append("EV:Initialized")
            return
        edge = self.inputs["power_button"] == 1 and self.power_level == 0
        self.power_level = self.inputs["power_button"]
        if self.state == "WaitPowerOn":
            self.wait_power_on(edge)
        elif self.state in DRIVING:
            if edge:
                self.sent.append("EV:PowerOffWaitByButton")
                self.state = "PowerOffByButton"
                self.entry_tick = self.now
            else:
                self.bus_faults()
        elif self.state == "PowerOffByButton":
            if self.now == self.entry_tick + 50:
                self.finish()
        elif self.release_tick < 0:
            if edge:
                self.release_tick = self.now
        elif self.now == self.release_tick + 10:
            self.finish()

    def wait_power_on(self, edge: bool) -> None:
        if self.trigger_tick < 0:
            if edge:
                self.trigger_tick = self.now
                self.sent.append("EV:PowerOnTrigger")
            return
        age = self.now - self.trigger_tick
        if age < 30:
            return
        if self.inputs["bus_unplugged"]:
            if age < 300:
                return
            result = "Timeout"
        elif self.inputs["joystick_fault"] or self.inputs["bus_noise"]:
            result = "Error1"
        elif self.inputs["power_module_fault"] or self.inputs["vr2_fault"]:
            result = "Error2"
        else:
            result = "Success"
            self.state = "Standby"
            self.last_ok = self.now
        self.trigger_tick = -1
        self.sent.append("EV:PowerOn" + result)

    def bus_faults(self) -> None:
        for name, _ in FAULTS:
            self.fault_ticks[name] = self.fault_ticks[name] + 1 if self.inputs[name] else 0
        for name, cause in FAULTS:
            if self.fault_ticks[name] == 11:
                self.force_off(cause)
                return

    def force_off(self, cause: str) -> None:
        self.state = "PowerOffByOthers"
        self.release_tick = -1
        self.sent.append("EV:PowerOffWaitBy" + cause)

    def finish(self) -> None:
        self.sent.append("EV:PowerOffFinished")
        self.wipe()
        self.state = "Initialize"

    # commands

    def commands(self) -> None:
        quota = 2 if self.state in DRIVING else 1 if self.now % 2 == 0 else 0
        for _ in range(quota):
            if b"\n" not in self.buffer:
                return
            line, self.buffer = self.buffer.split(b"\n", 1)
            if line.endswith(b"\r"):
                line = line[:-1]
            if line:
                self.command(line)

    def command(self, line: bytes) -> None:
        was_stable = self.stable
        whole = line
        try:
            if was_stable:
                if chr(line[-1]).upper() != check(line[:-1]):
                    raise CommandError("CommandChecksum")
                line = line[:-1]
            names = [name for name in NAMES if line.startswith(name.encode("ascii"))]
            if not names:
                raise CommandError("CommandUnknown")
            name = names[0]
            try:
                self.obey(name, line[len(name) :])
            except ValueError:
                raise CommandError(name) from None
        except CommandError as error:
            self.reply(f"ER:{error}")
            if whole.startswith(b"beep"):
                self.pattern = []
                self.pattern_start = self.now
            return
        self.last_ok = self.now
        if not was_stable:
            self.reply("OK:" + name)
        if name in ANSWERS:
            self.reply(ANSWERS[name])
        if name == "poweroff":
            self.force_off("Host")

    def obey(self, name: str, digits: bytes) -> None:
        if name in ANSWERS:
            numbers(digits, [])
        else:
            getattr(self, "obey_" + name)(digits)

    def must_drive(self) -> None:
        if self.state not in DRIVING:
            raise ValueError("state")

    def obey_limit(self, digits: bytes) -> None:
        values = numbers(digits, [2] * 5)
        within(values, [100, 100, 255, 255, 255])
        self.must_drive()
        self.limits = values
        if self.state != "Limit":
            self.gear = "N"
        self.state = "Limit"

    def obey_output(self, digits: bytes) -> None:
        v, w = (value - 256 if value > 127 else value for value in numbers(digits, [2, 2]))
        within([abs(v), abs(w)], [100, 100])
        self.must_drive()
        self.output = (v, w)
        self.state = "Output"

    def obey_poweroff(self, digits: bytes) -> None:
        numbers(digits, [])
        self.must_drive()

    def obey_speedmode(self, digits: bytes) -> None:
        mode, lock = numbers(digits, [1, 1])
        within([mode, lock], [5, 1])
        if mode == 0:
            raise ValueError("range")
        self.speed_mode = mode
        self.locked = lock == 1

    def obey_joystick(self, digits: bytes) -> None:
        values = numbers(digits, [2, 2, 2, 2, 1, 1, 1, 2, 2, 2])
        within(values[:7], [100, 100, 100, 100, 15, 15, 3])
        if values[6] >= 2:
            within(values[7:], [100, 90, 90])
        if values[0] >= values[2] or values[1] >= values[3]:
            raise ValueError("lower >= upper")
        if values[6] != self.joystick[6]:
            self.gear = "N"
        for number, top in ((7, 100), (8, 90), (9, 90)):
            if values[number] > top:
                values[number] = self.joystick[number]
        self.joystick = values

    def obey_watchdog(self, digits: bytes) -> None:
        (self.watchdog_ticks,) = numbers(digits, [2])

    def obey_stablemode(self, digits: bytes) -> None:
        values = numbers(digits, [1])
        within(values, [1])
        self.stable = values == [1]

    def obey_status(self, digits: bytes) -> None:
        if digits[:1] != b"A":
            raise ValueError("type")
        values = numbers(digits[1:], [1])
        within(values, [1])
        self.status = values == [1]

    def obey_beep(self, digits: bytes) -> None:
        times = numbers(digits, [2] * 10)
        self.pattern = []
        for i in range(10):
            self.pattern += [1 - i % 2] * times[i]
        self.pattern_start = self.now + 1

    # watchdog

    def watchdog(self) -> None:
        if self.state not in DRIVING or self.watchdog_ticks == 0:
            return
        if self.now - self.last_ok >= self.watchdog_ticks:
            self.force_off("Watchdog")

    # outputs

    def stick_drives(self) -> bool:
        return self.state == "Limit" or (self.state == "Standby" and self.button_mode >= 0)

    def drive(self) -> None:
        self.by_stick = self.stick_drives()
        if self.state == "Output":
            self.out_v, self.out_w = self.output
        elif self.state == "Limit":
            v, w = self.reversed_stick(self.joystick[6])
            self.out_v, self.out_w = limited(v, w, self.limits)
        elif self.stick_drives():
            self.out_v, self.out_w = self.reversed_stick(self.button_mode)
        else:
            self.out_v, self.out_w = 0, 0

    def reversed_stick(self, mode: int) -> tuple[int, int]:
        low_v, low_w, high_v, high_w, n_v, n_w, _, radius, switch, fade = self.joystick
        raw_v = self.inputs["stick_v_pct"]
        raw_w = self.inputs["stick_w_pct"]
        v = shape(raw_v, low_v, high_v, n_v)
        w = shape(raw_w, low_w, high_w, n_w)
        if mode == 1:
            return max(v, 0), w
        if mode in (2, 3):
            self.change_gear(raw_v, raw_w, radius, switch)
            if self.neutral_ticks > 0:
                return 0, 0
            if self.gear == "F":
                return max(v, 0), w
            if raw_v > 0:
                return 0, 0
            theta = angle(raw_v, raw_w)
            k = Fraction(1) if theta <= fade else (90 - theta) / (90 - fade)
            v = int(v * k)
            w = int(w * k)
            if mode == 3:
                w = -w
        return v, w

    def change_gear(self, v: int, w: int, radius: int, switch: int) -> None:
        if v * v + w * w <= radius * radius:
            self.neutral_ticks += 1
            if self.neutral_ticks > 20:
                self.gear = "N"
            return
        self.neutral_ticks = 0
        if self.gear == "N":
            self.gear = "R" if angle(v, w) <= switch else "F"
            self.gear_tick = self.now

    # SA line

    def status_line(self) -> None:
        if self.state not in DRIVING or not self.status:
            return
        line = "SA:"
        line += twos_hex(self.inputs["stick_v_pct"]) + twos_hex(self.inputs["stick_w_pct"])
        line += twos_hex(self.out_v) + twos_hex(self.out_w)
        line += f"{self.inputs['gauge']:X}{self.speed_mode:X}"
        for name in ("speed_up_button", "speed_down_button", "alarm_button"):
            line += f"{self.counters[name]:X}"
        self.sent.append(line + check(line.encode("ascii")))
        self.cost += 20

    # load account

    def account(self) -> None:
        if self.state in DRIVING:
            self.backlog = max(0, self.backlog + self.cost - 100)
            self.costs = [*self.costs[-9:], self.cost]
            if self.backlog >= 300:
                self.force_off("OverTime")
                self.drive()
        if self.state not in DRIVING:
            self.backlog = 0
            self.costs = [0] * 10

    def pace(self) -> int:
        """Return how many lines a second take the RRC to 90 %, and two in a tick to 90 %."""
        if self.state not in DRIVING:
            return 0 if self.state == "Off" else 45
        left = 90 - 30 - self.inputs["extra_load_pct"] - 20 * self.status
        return max(0, min(180, left * 100 // (25 if self.stable else 40)))

    # buzzer

    def sound(self) -> None:
        position = self.now - self.pattern_start
        if position < 0:
            self.buzzer = 0
        elif position < len(self.pattern):
            self.buzzer = self.pattern[position]
        elif self.gear == "R" and self.by_stick and self.state in DRIVING:
            self.buzzer = 1 if (self.now - self.gear_tick) % 100 < 50 else 0
        else:
            self.buzzer = 0
