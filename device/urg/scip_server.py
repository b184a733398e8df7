"""The sensor's side of SCIP 2.0: commands and their answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from tickrig.device.body import Pose
from tickrig.device.twin import Part
from tickrig.device.urg import first_protocol
from tickrig.device.urg.first_protocol import BY_DEFAULT, CONDITION, Capture, Settings, version
from tickrig.device.urg.world import BIT_RATE, LAST_STEP, URG_04LX, UrgParameters, View, World
from tickrig.wire import scip
from tickrig.wire import scip as status
from tickrig.wire.instant import NEVER

# Theory of operation
# ===================
#
# Two clocks and three memories make the behaviour; everything else is text.
#
# The clocks. `_Rotation` counts whole turns of the mirror from `began_us`, without drift. Scans end
# at multiples of its period from this time. `_timer` counts milliseconds from `_zero_us`, modulo
# 2^24, and stamps each scan with the time of its beginning (decision U2 in the reference page). CR
# restarts the turn; TM and the laser do not. RS and power-up restart both clocks. `due_us` is the
# end of the present scan, or `NEVER` while the laser is off: nothing else in this module happens
# without input.
#
# The memories. `_waiting` is one GD, GS or G that came before the first scan was ready. `_running`
# is the one MD or MS. `_latest` is the latest scan. Rules:
#
# - GD and GS need the laser (without it, status 10). They answer at once with `_latest`, and wait
#   only before the first scan. A second command that would wait gets status 0B (U5).
# - MD and MS switch the laser on themselves. Their first scan is the first one that begins after
#   the command (`begins_us`), not the scan that is in progress when the command arrives. Scan
#   interval and count start from that scan. After the last scan the laser goes off.
# - `stop` clears all three memories and switches the laser off. QT, TM0, TM2, RS, trouble and the
#   end of MD all call it, so no reply can come from a measurement that was stopped.
# - A fault (`fail`) answers waiting requests with its status before it drops them.
#
# `Urg.tick` sets the order in a tick: power and inputs, the end of a scan, then commands. So a GD
# that arrives in the tick in which a scan ends gets that scan.
#
# MD has two kinds of reply. `00P` comes at once. Then each scan comes with the same echo, in which
# the number of scans is replaced by the number of scans that remain, and with status `99b`:
#
# MD0044072501000 -> MD0044072501000 00P
#                ... MD0044072501000 99b, time stamp, blocks     (00 has no end)
#
# SCIP 1.1 (first_protocol.py) acts on the same state through the `Sensor` protocol: V, L, G, S and
# SCIP2.0. In SCIP 1.1 the laser is on after power-up, and II calls that mode CLASSIC until MD, MS
# or the laser's end (U12): `_classic`. `SCIP2.0` changes nothing but the protocol, so a switch in
# the middle of a measurement loses nothing. Only a power cut returns to SCIP 1.1.
#
# Numbers: `SIZES`, characters of parameters, and status codes come from SCIP 2.0. Where SCIP 2.0
# does not define the behaviour, hosts (HokuyoAIST, urg_library, hokuyolx) decide, each case with
# its U number.

# Reasons to refuse a command (SCIP 2.0, sensor commands and response to invalid commands).

_NOT_A_NUMBER = ("01", "02", "03", "06", "07")
"""Statuses for starting step, end step, cluster count, scan interval, number of scans."""


def _refusal(command: scip.Command, *, adjusting: bool) -> str:
    """Return the status for an invalid or untimely command, or "" if the command is valid."""
    if command.symbol not in scip.SIZES:
        return status.UNKNOWN
    # The semicolon is part of `string`; the 16 letters of SCIP 2.0 follow it.
    if len(command.string) > scip.MOST_STRING + 1:
        return status.STRING_TOO_LONG
    if not scip.LETTERS.issuperset(command.string[1:]):
        return status.STRING_LETTERS
    wanted: int = sum(scip.SIZES[command.symbol])
    if len(command.parameters) != wanted:
        return status.TOO_SHORT if len(command.parameters) < wanted else status.TOO_LONG
    if adjusting and command.symbol not in ("TM", "RS"):
        return status.UNKNOWN  # by which the vendor's urg_library knows the mode
    return ""


def _flaw(command: scip.Command) -> str:
    """Return the status that refuses the parameters of MD, MS, GD or GS, or "" if valid."""
    # GD and GS have three fields, MD and MS five; the codes follow the order of the fields.
    for text, code in zip(command.fields, _NOT_A_NUMBER, strict=False):
        if not text.isdecimal():
            return code
    first, last = (int(text) for text in command.fields[:2])
    if max(first, last) > LAST_STEP:
        return "04"
    return "05" if last < first else ""


# The rotating mirror: start and end of scans.

_TURN_US_RPM = 60_000_000


@dataclass(slots=True)
class _Rotation:
    """The rotation of the mirror, with one scan per turn and without drift.

    Attributes:
        speed_rpm: number of turns per minute.
        level: parameter of CR, 0..10. Each level reduces the speed by 1 %.
        began_us: start of the first scan at this speed.
    """

    speed_rpm: int
    level: int = 0
    began_us: int = field(default=0, init=False)

    @property
    def present_rpm(self) -> int:
        """Speed in turns per minute, reduced by the present level."""
        return self.speed_rpm * (100 - self.level) // 100

    @property
    def period_us(self) -> int:
        """Duration of a turn."""
        return _TURN_US_RPM // self.present_rpm

    @property
    def text(self) -> str:
        """The speed, as reported by II."""
        speed = f"{self.present_rpm}[rpm]"
        return speed if self.level else f"Initial({speed}){BY_DEFAULT}"

    def whole_end_us(self, now_us: int) -> int:
        """Return the end of the first scan that starts now or later."""
        period_us = self.period_us
        # Rounded up: the scan that is running at `now_us` started before `now_us`, so it is not a
        # whole scan.
        return self.began_us + (-(-(now_us - self.began_us) // period_us) + 1) * period_us

    def change(self, now_us: int, level: int) -> None:
        """Set another level from now on."""
        self.level, self.began_us = level, now_us


# Requested measurements: one scan, or continuous scans.

_WIDEST = {2: 0xFFF, 3: 0x3_FFFF}
"""Largest distance by number of characters. Larger distances are sent as this value."""


@dataclass(slots=True)
class Stream:
    """A command of SCIP 2.0 that requests one or more scans.

    Attributes:
        command: the received command. It was already checked and is valid.
        begins_us: time from which scans count for the command. A scan that ends earlier is not
            sent.
        left: number of remaining scans, or 0 for scans without end.
        skipped: number of scans still to be skipped.
    """

    command: scip.Command
    begins_us: int
    left: int = 0
    skipped: int = 0

    @property
    def endless(self) -> bool:
        """Whether the command continues until it is stopped."""
        return self.command.fields[-1] == "00"

    def reply(self, view: View, code: str, echo: bytes) -> bytes:
        """Return a scan in the requested form."""
        first, last, cluster = (int(text) for text in self.command.fields[:3])
        width = scip.WIDTHS[self.command.symbol[1]]
        numbers, widest = view.distances(first, last, cluster), _WIDEST[width]
        if max(numbers, default=0) > widest:
            numbers = tuple(min(number, widest) for number in numbers)
        return scip.Reply(echo, code, scip.encode_scan(view.time_ms, numbers, width)).encode()

    def answer(self, view: View) -> bytes:
        """Return the scan of GD or GS."""
        return self.reply(view, status.OK, self.command.echo)

    def refuse(self, code: str) -> bytes:
        """Return the answer with the reason why no scan will follow."""
        return scip.Reply(self.command.echo, code).encode()

    def take(self, ended_us: int, view: View) -> bytes:
        """Return the answer for a scan of MD or MS."""
        # `begins_us` holds the end of the first whole scan, because scans are identified by their
        # end.
        if ended_us < self.begins_us:
            return b""
        if self.skipped:
            self.skipped -= 1
            return b""
        # Interval n: one scan is sent, then n are left out. The first scan is sent at once.
        self.skipped = int(self.command.fields[3])
        self.left -= not self.endless
        return self.reply(view, status.DATA, self.echo)

    @property
    def echo(self) -> bytes:
        """The command with the number of remaining scans."""
        head, command = self.command.parameters[:-2], self.command
        return scip.Command(command.symbol, f"{head}{self.left:02}", command.string).echo


_TIMER: Final = 2**24
"""Milliseconds after which the timer wraps."""

_LEVELS: Final = range(11)
_DEFAULT_LEVEL: Final = 99

_Answer = tuple[str, tuple[bytes, ...]]
"""Status and lines."""


class ScipServer(Part):
    """Executes the commands of a host in a URG sensor, and sends scans (SCIP 2.0, sensor commands).

    Until a host switches to SCIP 2.0, the server executes the commands of SCIP 1.1
    (`first_protocol`).

    The SCIP command `DB`, the mode for firmware updates, and the statuses 21..49 and 98 of a
    self-test are not emulated.

    Args:
        parameters: parameters of the sensor.

    Attributes:
        laser: whether the laser is on.
        settings: bit rate and sensitivity.
        rotation: rotation of the mirror.
        trouble: status code of the present fault, or empty without a fault.
        served: number of commands that were answered.
        scans: number of measured scans.
        due_us: end of the present scan.
    """

    def __init__(self, parameters: UrgParameters) -> None:
        self.parameters, self.trouble = parameters, ""
        self._commands: Mapping[str, Callable[[int, scip.Command], _Answer]] = {
            **dict.fromkeys(("MD", "MS"), self._stream),
            "BM": self._laser_on,
            "QT": self._quit,
            "RS": self._reset,
            "TM": self._time,
            "SS": self._rate,
            "CR": self._speed,
            "HS": self._sensitivity,
            "VV": self._version,
            "PP": self._specification,
            "II": self._state,
        }
        self.power_up(0)

    def power_up(self, now_us: int) -> None:
        """Restore the state after power-up."""
        self.served = self.scans = 0
        self._switched = self.parameters.scip == "2.0"
        self._begin(now_us)
        if not self._switched:
            # After `_begin`, whose `stop` has switched the laser off.
            self._classic = self.light(now_us)

    def _begin(self, now_us: int) -> None:
        self.rotation = _Rotation(URG_04LX.speed_rpm)
        self.rotation.began_us = self._zero_us = now_us
        first_rate = self.parameters.rs232_baud or BIT_RATE
        self._adjusting = False
        self.settings = Settings(first_rate, first_rate=first_rate)
        self.stop()

    def stop(self) -> None:
        """Switch the laser off and drop all requests."""
        self.laser, self.due_us = False, NEVER
        self._classic = False  # nothing has been requested since power-up
        self._running: Stream | None = None
        self._waiting: Stream | Capture | None = None
        self._latest: View | None = None

    def obey(self, now_us: int, line: bytes) -> bytes:
        """Return the immediate answer to a line."""
        self.served += 1
        if not self._switched:
            return first_protocol.obey(self, now_us, line)
        command = scip.Command.parse(line)
        code = _refusal(command, adjusting=self._adjusting)
        if code:
            return scip.Reply(command.echo, code).encode()
        if command.symbol in ("GD", "GS"):
            return self._single(now_us, command)
        code, lines = self._commands[command.symbol](now_us, command)
        return scip.Reply(command.echo, code, lines).encode()

    def fail(self, code: str) -> bytes:
        """Stop because of a fault; answer waiting requests with the status of the fault."""
        self.trouble = code
        waiting = [stream for stream in (self._waiting, self._running) if stream]
        self.stop()
        return b"".join(stream.refuse(code) for stream in waiting)

    def end_scan(self, pose: Pose, world: World) -> bytes:
        """End the present scan; return the answers for the scan."""
        ended_us, period_us = self.due_us, self.rotation.period_us
        self.due_us += period_us
        time_ms = self._timer(ended_us - period_us)
        view = View(self.scans, time_ms, pose, world, URG_04LX, self.parameters)
        self.scans, self._latest = self.scans + 1, view
        sent = b""
        if (waiting := self._waiting) is not None:
            sent, self._waiting = waiting.answer(view), None
        if (running := self._running) is not None:
            sent += running.take(ended_us, view)
            if not (running.left or running.endless):
                self.stop()
        return sent

    @property
    def serial(self) -> str:
        """The serial number."""
        return self.parameters.serial

    def light(self, now_us: int) -> bool:
        """Switch the laser on unless there is a fault; return whether it is on."""
        if not self.laser and not self.trouble:
            self.laser, self.due_us = True, self.rotation.whole_end_us(now_us)
        return self.laser

    def switch(self) -> None:
        """Switch to SCIP 2.0; nothing else changes."""
        self._switched = True

    def measure(self, capture: Stream | Capture) -> bytes | None:
        """Return the answer to a command that requests a single scan.

        Returns:
            The answer with the latest scan. The result is b"" if the sensor will send the answer
            after the next scan, or None if the laser is off or another command waits.
        """
        if not self.laser or self._waiting is not None:
            return None
        if self._latest is not None:
            return capture.answer(self._latest)
        self._waiting = capture
        return b""

    def _single(self, now_us: int, command: scip.Command) -> bytes:
        code = _flaw(command) or self.trouble
        if not (code or self.laser):
            code = status.LASER_OFF
        if not code and self._waiting is not None:
            code = status.REPEATED
        if code:
            return scip.Reply(command.echo, code).encode()
        return self.measure(Stream(command, now_us)) or b""

    def _stream(self, now_us: int, command: scip.Command) -> _Answer:
        code = _flaw(command) or self.trouble
        if not code and self._running is not None:
            code = status.REPEATED
        if code:
            return code, ()
        self.light(now_us)
        self._classic = False
        begins_us = self.rotation.whole_end_us(now_us)
        self._running = Stream(command, begins_us, int(command.fields[-1]))
        return status.OK, ()

    def _laser_on(self, now_us: int, command: scip.Command) -> _Answer:
        if self.trouble:
            return "01", ()
        if self.laser:
            return "02", ()
        self.light(now_us)
        return status.OK, ()

    def _quit(self, now_us: int, command: scip.Command) -> _Answer:
        self.stop()
        return status.OK, ()

    def _reset(self, now_us: int, command: scip.Command) -> _Answer:
        self._begin(now_us)
        return status.OK, ()

    def _time(self, now_us: int, command: scip.Command) -> _Answer:
        match command.parameters:
            case "0" | "2" as code:
                on = code == "0"
                if on == self._adjusting:
                    return ("02" if on else "03"), ()
                self._adjusting = on
                self.stop()
                return status.OK, ()
            case "1":
                if not self._adjusting:
                    return "04", ()
                return status.OK, (scip.with_sum(scip.encode_number(self._timer(now_us), 4)),)
            case _:
                return "01", ()

    def _speed(self, now_us: int, command: scip.Command) -> _Answer:
        if not command.parameters.isdecimal():
            return "01", ()
        level = int(command.parameters)
        level = 0 if level == _DEFAULT_LEVEL else level
        if level not in _LEVELS:
            return "02", ()
        if level == self.rotation.level:
            return "03", ()
        self.rotation.change(now_us, level)
        if self.laser:
            self.due_us = self.rotation.whole_end_us(now_us)
        return status.OK, ()

    def _rate(self, now_us: int, command: scip.Command) -> _Answer:
        return self.settings.set_rate(command.parameters), ()

    def _sensitivity(self, now_us: int, command: scip.Command) -> _Answer:
        return self.settings.set_sensitivity(command.parameters), ()

    def _version(self, now_us: int, command: scip.Command) -> _Answer:
        return status.OK, scip.encode_lines(version(self.serial))

    def _specification(self, now_us: int, command: scip.Command) -> _Answer:
        return status.OK, URG_04LX.lines

    def _timer(self, at_us: int) -> int:
        return (at_us - self._zero_us) // 1_000 % _TIMER

    def _state(self, now_us: int, command: scip.Command) -> _Answer:
        texts = {
            "MODL": URG_04LX.model,
            "LASR": "ON" if self.laser else "OFF",
            "SCSP": self.rotation.text,
            "MESM": self._mode,
            "SBPS": self.settings.rate_text,
            "TIME": f"{self._timer(now_us):06X}",
            "STAT": CONDITION[self.trouble],
        }
        return status.OK, scip.encode_lines(texts)

    @property
    def _mode(self) -> str:
        """Measuring mode, as reported by II."""
        if not self.laser:
            return "IDLE"
        return "CLASSIC" if self._classic else self.settings.mode
