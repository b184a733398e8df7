"""The RRC: its work in each period of 10 ms."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.physical import InputBank, OutputSignal
from tickrig.device.rrc.board import OUTPUTS, Buzzer, LoadAccount, PowerSequence, new_inputs
from tickrig.device.rrc.drive import Drive, chosen_mode, count_button_edges
from tickrig.device.rrc.settings import NEXT_STATE, POWERED_ON, Move, RrcConfig, RrcState, Settings
from tickrig.device.rrc.vehicle import Vehicle
from tickrig.device.twin import Copyable
from tickrig.wire.errors import ChecksumError
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rrc import replies
from tickrig.wire.rrc.commands import BadParameters, Command, UnknownCommand, parse_command
from tickrig.wire.rrc.message import (
    LINES_A_PERIOD,
    PACE_WITHOUT_VR2,
    PERIOD_PCT,
    pace_lines_s,
    strip_check,
)
from tickrig.wire.rrc.replies import StatusA

# Theory of operation
# ===================
#
# One tick is one internal command period of the RRC, 10 ms. `Rrc.tick` does everything that happens
# in a tick, in the order of DECISION R28. The lines of a tick leave in the same order:
#
# 1. bytes of the line        ER:ReceiveBufferOverflow for each overflow
# 2. buttons, faults, time    EV lines of power-on, power-off and faults
# 3. lines, up to the quota   OK, ER, and the answers of device, version and date
# 4. watchdog                 EV:PowerOffWaitByWatchdog
# 5. motors, vehicle          sends nothing; the SA line of step 6 shows what they get
# 6. SA line, load account    SA, then EV:PowerOffWaitByOverTime
# 7. buzzer                   sends nothing
#
# The order is part of the behaviour:
#
# - Power events come before lines, so a command that arrives in the tick of the power button meets
#   the new state.
# - The watchdog comes after the lines, so a command in the tick of its expiry still renews it
#   (R20).
# - The motors come before SA, so #3 and #4 show the values of this tick.
#
# The golden vectors (`tests/device/rrc/test_vectors.py`) and a second, independent model
# (`reference_model.py` in the same folder) both check the order.
#
# What depends on what:
#
# - `_move` is the only place that changes the state, and `NEXT_STATE` the only table. `_move` also
#   does what the change implies. A pass through Initialize wipes what commands have set (R5).
#   Crossing the border of `POWERED_ON` restarts the power sequence and the load account. Entering
#   Standby renews the watchdog (R20). Entering Limit disengages the gear (R18).
# - `POWERED_ON` is the manual's "PowerOnSuccess period". Quota, watchdog, SA lines, load account,
#   button counters and alarm all run in these three states only. If you add a state, decide whether
#   it belongs in that tuple.
# - `_wipe` resets exactly what Initialize resets. `config` and `inputs` survive a power cut. The
#   receive buffer survives Initialize but not a power cut. If you add state elsewhere, wipe it in
#   `_wipe` or in `reset`, or a second power-on differs from the first.
# - Costs are charged where the bytes come in, not where lines are obeyed (R27): `rx.count` counts
#   each LF that arrives, even one that an overflow discards. `_replies` counts lines that answer a
#   line, so EV, SA and overflow lines must not go through `_reply`.
# - `_quiet` says that `_read_inputs` did nothing and would do nothing again: VR2 runs, no fault is
#   being timed, and no state has changed since. Then only a changed input makes it run.
# - `_next_due` must include every tick in which anything changes without traffic. A rig in virtual
#   time skips all others: a timer that is missing from `_next_due` works in real time and fails in
#   virtual time. While SA lines run or the load account drains, each tick is due.
#
# Numbers: the manual gives the period, the ranges and "about 2 commands per 10 ms". Durations (R6),
# the load model (R27), buffer size and alarm pattern are decisions, listed in the reference page of
# the device. Hosts pace themselves by the same constants in `tickrig.wire.rrc.message`.

# Input from the line: waiting bytes, lines, commands and refusals.


@dataclass(slots=True)
class ReceiveBuffer:
    """Buffer for received bytes that wait to be processed, split into lines (DECISION R27).

    If a byte does not fit, the buffer drops all waiting bytes. It then discards this byte and all
    following bytes up to the next LF.

    Attributes:
        size: capacity in bytes, including line ends.
        overflows: number of overflows.
        thrown_blocks: number of full blocks of `size` bytes that were discarded after overflows.
            After each overflow, the count of the bytes of a block starts from 0. A block costs as
            much processing time as an overflow.
    """

    size: int
    _lines: deque[bytes] = field(default_factory=deque, init=False)
    _used: int = field(default=0, init=False)
    _begun: bytes = field(default=b"", init=False)
    _thrown: int | None = field(default=None, init=False)  # bytes of the line behind an overflow
    overflows: int = field(default=0, init=False)
    thrown_blocks: int = field(default=0, init=False)

    def __bool__(self) -> bool:
        """Whether a whole line waits."""
        return bool(self._lines)

    def push(self, data: bytes) -> None:
        """Receive bytes from the line."""
        *lines, tail = data.split(b"\n")
        for line in lines:
            self._push(line, 1)
            if self._thrown is None:
                self._lines.append(self._begun)
            self._begun, self._thrown = b"", None
        self._push(tail, 0)

    def pop(self) -> bytes:
        """Take the oldest whole line, without its LF."""
        line = self._lines.popleft()
        self._used -= len(line) + 1
        return line

    def _push(self, piece: bytes, end: int) -> None:
        """Append a piece of one line, and its LF if `end` is 1."""
        if self._thrown is None:
            beyond = self._used + len(piece) + end - self.size
            if beyond <= 0:
                self._used += len(piece) + end
                self._begun += piece
                return
            self._lines.clear()
            self._used, self._begun = 0, b""
            self.overflows += 1
            before, piece = 0, piece[len(piece) + end - beyond + 1 :]  # behind the byte too many
        else:
            before = self._thrown
        self._thrown = before + len(piece)
        self.thrown_blocks += self._thrown // self.size - before // self.size


def _read_line(line: bytes, *, check_wanted: bool) -> Command | replies.Refusal | None:
    """Return the command of a line, or its refusal (DECISION R11), or None if the line is empty."""
    # One CR before the LF is removed, because terminals send CR LF (R11). A person who presses
    # Enter sends an empty line; it has no reply.
    message = line.removesuffix(b"\r")
    if not message:
        return None
    try:
        return parse_command(strip_check(message) if check_wanted else message)
    except ChecksumError:
        return replies.Refusal(replies.COMMAND_CHECKSUM)
    except UnknownCommand:
        return replies.Refusal(replies.COMMAND_UNKNOWN)
    except BadParameters as error:
        return replies.Refusal(error.name.decode())


TICK_US: Final = 10_000
"""The RRC's internal command period (RRC manual, notes)."""

_MOVES: Final[dict[type[cmd.Command], Move]] = {
    cmd.Limit: Move.LIMIT,
    cmd.Output: Move.OUTPUT,
    cmd.PowerOff: Move.FORCED,
}

_STAYS: Final = ((Move.OUTPUT, RrcState.OUTPUT), (Move.LIMIT, RrcState.LIMIT))
"""Transitions of `NEXT_STATE` that change nothing."""


@mypyc_attr(allow_interpreted_subclasses=True, serializable=True)
@dataclass(slots=True)
class Rrc(Copyable):
    """An emulated RRC (Robotic Relay Communicator), which controls a VR2 wheelchair for a host.

    The class implements the protocol `Device[bytes]`. If `config.vehicle` is set, the emulation
    includes the motion of the wheelchair. Its speeds and other numbers are assumptions
    (vehicle.py).

    The traffic on the VR2 bus, the sound of the horn and the USB serial driver are not emulated.

    Attributes:
        config: configuration with durations, names and sizes.
        inputs: physical inputs; see `board.INPUTS`.
        state: state in the state diagram of the manual.
    """

    config: RrcConfig = field(default_factory=RrcConfig)
    inputs: InputBank = field(default_factory=new_inputs)
    state: RrcState = field(default=RrcState.OFF, init=False)
    _settings: Settings = field(init=False)
    _buffer: ReceiveBuffer = field(init=False)
    _power: PowerSequence = field(init=False)
    _drive: Drive = field(init=False)
    _vehicle: Vehicle = field(init=False)
    _buzzer: Buzzer = field(init=False)
    _load: LoadAccount = field(init=False)
    _renewed: int = field(default=0, init=False)  # tick of the latest correct command
    _moved: int = field(default=0, init=False)  # tick of the latest transition
    _quiet: bool = field(default=False, init=False)  # same inputs: `_read_inputs` does nothing
    _due_us: int = field(init=False)
    _sent: list[bytes] = field(default_factory=list, init=False)
    _commands: int = field(default=0, init=False)
    _replies: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Start without power."""
        self.reset()

    @property
    def type_name(self) -> str:
        """Name of the device type, for traces."""
        return "rrc"

    @property
    def tick_us(self) -> int:
        """The internal period."""
        return TICK_US

    @property
    def due_us(self) -> int:
        """The time of the next event without a command."""
        return 0 if self.inputs.changed else self._due_us

    @property
    def outputs(self) -> dict[str, OutputSignal]:
        """The outputs that `read` accepts."""
        return OUTPUTS

    def reset(self) -> None:
        """Reset everything but configuration and physical inputs; the vehicle is at rest again."""
        self._vehicle = Vehicle(self.config.battery_wh)
        self._lose_power()
        self._due_us = 0

    def _lose_power(self) -> None:
        """Reset the state that a power cut of the RRC erases; the vehicle keeps rolling."""
        self.state, self._quiet = RrcState.OFF, False
        self._buffer = ReceiveBuffer(self.config.buffer_bytes)
        self._power, self._load = PowerSequence(self.config), LoadAccount()
        self._wipe()

    def read(self, name: str, /) -> int | str:
        """Return the value that a physical output had after the latest tick.

        Args:
            name: name of an output in `outputs`.

        Returns:
            The value of the output.

        Raises:
            KeyError: there is no output of that name.
        """
        return _READERS[name](self)

    @property
    def _pace_lines_s(self) -> int:
        now, extra_pct = self._settings, self._load.extra_pct
        if self.state in POWERED_ON:
            return pace_lines_s(stable=now.stable, status=now.status, extra_pct=extra_pct)
        return 0 if self.state is RrcState.OFF else PACE_WITHOUT_VR2

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Run one period of the RRC.

        The top of this file lists the steps of a period in their order (DECISION R28).

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: bytes that have arrived since the latest tick.

        Returns:
            The bytes that the RRC sends in this tick.
        """
        tick, inputs = now_us // TICK_US, self.inputs
        looks = inputs.changed or not self._quiet
        inputs.changed = False
        if looks and not inputs["rrc_power"]:
            self._lose_power()
            self._roll()
            self._due_us = now_us + TICK_US if self._rolls else NEVER
            return b""
        if self.state is RrcState.OFF:
            self._boot(tick)
        self._sent, self._commands, self._replies = [], 0, 0
        # The order from here on is R28; see the top of this file.
        overflows = self._receive(rx) if rx else 0
        if looks:
            self._read_inputs(tick)
        self._work(tick)
        self._watch(tick)
        self._drive.step(tick, self.state, self._settings, inputs)
        self._roll()
        self._report_and_account(tick, rx.count(b"\n"), overflows)
        running = self.state in POWERED_ON
        self._buzzer.tick(tick, self._drive.alarm_since if running else None)
        self._due_us = min(self._next_due(tick) * TICK_US, NEVER)
        return b"".join(self._sent)

    def _boot(self, tick: int) -> None:
        """Make transition 1 in the previous tick, so that this tick ends Initialize."""
        self.state = RrcState.INITIALIZE
        self._power.enter(self.state, tick - 1)

    def _receive(self, rx: bytes) -> int:
        """Receive bytes; return the number of overflows that the load account must charge."""
        buffer = self._buffer
        overflows, thrown = buffer.overflows, buffer.thrown_blocks
        buffer.push(rx)
        overflows, thrown = buffer.overflows - overflows, buffer.thrown_blocks - thrown
        self._sent += [replies.Refusal(replies.RECEIVE_BUFFER_OVERFLOW).encode()] * overflows
        return overflows + thrown

    def _read_inputs(self, tick: int) -> None:
        """Process buttons, faults and time."""
        if self.state in POWERED_ON and count_button_edges(self.inputs, self._settings):
            self._choose_drive()
        event, move = self._power.step(self.state, tick, self.inputs)
        if event is not None:
            self._sent.append(replies.Event(event).encode())
        if move is not None:
            self._move(move, tick)
        self._quiet = self.state in POWERED_ON and move is None and not self._power.waiting

    def _choose_drive(self) -> None:
        """Set the reverse mode in Standby by the held buttons (DECISION R8)."""
        mode = chosen_mode(self.inputs)
        if self.state is RrcState.STANDBY and mode != self._settings.button_mode:
            self._settings.button_mode = mode
            self._drive.gearbox.reset()

    def _work(self, tick: int) -> None:
        """Process as many lines as the period allows."""
        # "About 1 command per 20 ms" without VR2: one in each even tick (R27). The quota is fixed
        # before the first line is processed. So if the first line is `poweroff`, a second line is
        # still processed.
        quota = LINES_A_PERIOD if self.state in POWERED_ON else 1 - tick % 2
        while self._commands < quota and self._buffer:
            self._commands += 1
            self._answer(self._buffer.pop(), tick)

    def _answer(self, line: bytes, tick: int) -> None:
        """Execute a line; the reply uses the mode in which the line arrived (DECISION R21)."""
        # Read the mode before the command acts: `stablemode1` still gets its OK, and `stablemode0`
        # with CHECK gets none (R21).
        stable = self._settings.stable
        request = _read_line(line, check_wanted=stable)
        if request is None:
            return
        if isinstance(request, replies.Refusal):
            if line.startswith(cmd.Beep.name):  # refused for whatever reason (DECISION R9)
                self._buzzer.silence()
            self._reply(request)
        elif self._obey(request, tick):
            # Only an obeyed command renews the watchdog; a line that is answered with ER does not
            # (RRC manual, `watchdog`).
            self._renewed = tick
            if not stable:
                self._reply(replies.Ok(request.name.decode()))
            self._follow_up(request)
        else:
            self._reply(replies.Refusal(request.name.decode()))

    def _obey(self, command: cmd.Command, tick: int) -> bool:
        """Execute a command; return False if the state does not allow it (DECISION R10)."""
        move = _MOVES.get(type(command))
        if move is not None and not self._move(move, tick):
            return False
        if isinstance(command, cmd.Beep):
            self._buzzer.play(tick, command.times_10ms)
        if self._changes_reverse_mode(command):
            self._drive.gearbox.reset()
        self._settings.store(command)
        return True

    def _changes_reverse_mode(self, command: cmd.Command) -> bool:
        now = self._settings.joystick.reverse_mode
        return isinstance(command, cmd.Joystick) and command.reverse_mode != now

    def _follow_up(self, command: cmd.Command) -> None:
        """Send the lines after the OK line (DECISION R12, R26)."""
        match command:
            case cmd.DeviceName():
                self._reply(replies.Text(self.config.device_name))
            case cmd.Version():
                self._reply(replies.Text(self.config.version))
            case cmd.Date():
                self._reply(replies.Text(self.config.date))
            case cmd.PowerOff():
                self._sent.append(replies.Event(replies.RrcEvent.BY_HOST).encode())
            case _:
                return

    def _watch(self, tick: int) -> None:
        """Trip the watchdog (DECISION R20)."""
        ticks = self._settings.watchdog_ticks
        if ticks and self.state in POWERED_ON and tick - self._renewed >= ticks:
            self._stop_by_force(replies.RrcEvent.BY_WATCHDOG, tick)

    def _stop_by_force(self, cause: replies.RrcEvent, tick: int) -> None:
        self._move(Move.FORCED, tick)
        self._sent.append(replies.Event(cause).encode())

    @property
    def _rolls(self) -> bool:
        """Return whether the vehicle changes in each tick: it moves, or VR2 drains the battery."""
        return self.config.vehicle and (self.state in POWERED_ON or self._vehicle.moving)

    def _roll(self) -> None:
        """Advance the vehicle, if it exists."""
        if self.config.vehicle:
            self._vehicle.set_gauge(self.inputs["gauge"])
            running = self.state in POWERED_ON
            self._vehicle.step(self._drive.out_pct, self._settings.speed_mode, running=running)

    def _report_and_account(self, tick: int, line_feeds: int, overflows: int) -> None:
        """Send the SA line, then check whether the work fitted into the period."""
        load, status = self._load, self._settings.status
        if self.state in POWERED_ON:
            if status:
                self._sent.append(self._status())
            extra_pct = self.inputs["extra_load_pct"]
            load.spend(line_feeds, overflows, self._replies, status=status, extra_pct=extra_pct)
            if self.config.overtime and load.too_far_behind:
                self._stop_by_force(replies.RrcEvent.BY_OVER_TIME, tick)
                # The motors already had their values for this tick, from the state before. Stop
                # them now, not one tick later.
                self._drive.step(tick, self.state, self._settings, self.inputs)  # motors stop

    def _status(self) -> bytes:
        now, inputs = self._settings, self.inputs
        return StatusA.line(
            (inputs["stick_v_pct"], inputs["stick_w_pct"]),
            self._drive.out_pct,
            self._vehicle.shown_gauge if self.config.vehicle else inputs["gauge"],
            now.speed_mode,
            (now.speed_up_count, now.speed_down_count, now.alarm_count),
        )

    def _reply(self, reply: replies.Ok | replies.Refusal | replies.Text) -> None:
        self._replies += 1
        self._sent.append(reply.encode())

    def _move(self, move: Move, tick: int) -> bool:
        """Change the state; return False if the transition does not exist."""
        if (move, self.state) in _STAYS:  # most commands of a host that drives
            self._moved = tick
            return True
        self._quiet = False
        state = NEXT_STATE.get((self.state, move))
        if state is None:
            return False
        if state is RrcState.LIMIT and self.state is not RrcState.LIMIT:
            self._drive.gearbox.reset()
        if self.state not in POWERED_ON or state not in POWERED_ON:
            self._power.enter(state, tick)
            self._load = LoadAccount()
        if state is RrcState.STANDBY:
            self._renewed = tick
        # Leaving Initialize counts as well as entering it. Initialize may last several ticks; the
        # commands that arrive in it are executed (R10), but their effects end with Initialize.
        if RrcState.INITIALIZE in (self.state, state):  # what commands set in there goes, too
            self._wipe()
        self.state, self._moved = state, tick
        if state is RrcState.POWER_OFF_FINISHED:
            self._move(Move.RESTART, tick)
        return True

    def _wipe(self) -> None:
        """Reset the values that Initialize resets (RRC manual, state description; DECISION R5)."""
        self._settings = Settings()
        self._drive, self._buzzer = Drive(), Buzzer()

    def _next_due(self, tick: int) -> int:
        """Return the next tick in which anything happens without input, or `NEVER`."""
        settings, running = self._settings, self.state in POWERED_ON
        busy = self._buffer or not self._load.settled or (settings.status and running)
        busy = busy or self._rolls
        if busy or self._moved == tick:  # a new state looks at buttons from the next tick on
            return tick + 1
        due = self._power.due_tick(self.state)
        for changes_at in (self._buzzer.changes_at, self._drive.changes_at):
            if changes_at is not None:
                due = min(due, changes_at)
        if running and settings.watchdog_ticks:
            due = min(due, self._renewed + settings.watchdog_ticks)
        return due


_READERS: Final[dict[str, Callable[[Rrc], int | str]]] = {
    "state": lambda rrc: rrc.state.value,
    "vr2_power": lambda rrc: int(rrc.state in POWERED_ON),
    "error_led": lambda rrc: int(rrc.state is RrcState.POWER_OFF_BY_OTHERS),
    "stick_drives": lambda rrc: int(rrc._drive.by_stick),
    "out_v_pct": lambda rrc: rrc._drive.out_pct[0],
    "out_w_pct": lambda rrc: rrc._drive.out_pct[1],
    "speed_mode": lambda rrc: rrc._settings.speed_mode,
    "gear": lambda rrc: rrc._drive.gearbox.gear.value,
    "buzzer": lambda rrc: int(rrc._buzzer.sounding),
    "load_pct": lambda rrc: rrc._load.load_pct,
    "margin_pct": lambda rrc: PERIOD_PCT - rrc._load.load_pct,
    "backlog_pct": lambda rrc: rrc._load.backlog_pct,
    "pace_lines_s": lambda rrc: rrc._pace_lines_s,
    "speed_mm_s": lambda rrc: round(rrc._vehicle.speed_mm_s),
    "turn_mrad_s": lambda rrc: round(rrc._vehicle.turn_mrad_s),
    "distance_mm": lambda rrc: round(rrc._vehicle.distance_mm),
    "heading_mrad": lambda rrc: round(rrc._vehicle.heading_mrad),
    "battery_permille": lambda rrc: round(rrc._vehicle.charge * 1_000),
}
"""Functions of `Rrc.read`, by name of the output; only the requested output is computed."""
