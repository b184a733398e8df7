"""The RRC: what it does in each period of 10 ms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, Final

from tickrig.device.physical import InputBank, OutputSignal
from tickrig.device.rrc.buzzer import Buzzer
from tickrig.device.rrc.config import RrcConfig
from tickrig.device.rrc.controller import chosen_mode, count_button_edges
from tickrig.device.rrc.drive import Drive
from tickrig.device.rrc.load import LoadAccount
from tickrig.device.rrc.power import PowerSequence
from tickrig.device.rrc.receive_buffer import ReceiveBuffer, read_line
from tickrig.device.rrc.settings import Settings
from tickrig.device.rrc.states import NEXT_STATE, POWERED_ON, Move, RrcState
from tickrig.device.rrc.terminals import OUTPUTS, new_inputs
from tickrig.device.twin import Copyable
from tickrig.wire.instant import NEVER
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rrc.load import LINES_A_PERIOD, PACE_WITHOUT_VR2, PERIOD_PCT, pace_lines_s
from tickrig.wire.rrc.replies import RECEIVE_BUFFER_OVERFLOW, Event, Ok, Refusal, RrcEvent, Text
from tickrig.wire.rrc.replies import StatusA as Status

TICK_US: Final = 10_000
"""The RRC's internal command period (RRC manual, notes)."""

MOVES: Final[dict[type[cmd.Command], Move]] = {
    cmd.Limit: Move.LIMIT,
    cmd.Output: Move.OUTPUT,
    cmd.PowerOff: Move.FORCED,
}


@dataclass(slots=True)
class Rrc(Copyable):
    """The Robotic Relay Communicator with the VR2 wheelchair around it; a `Device[bytes]`.

    Not emulated: the traffic on the VR2 bus itself, how fast the vehicle drives
    in which speed mode, what the alarm button's horn sounds like, the USB
    serial driver.

    Attributes:
        type_name: what its device type is called, for traces.
        config: durations, names and sizes.
        inputs: what the world does to it, see `terminals.INPUTS`.
        state: where it is in the manual's state diagram.
    """

    type_name: ClassVar[str] = "rrc"
    config: RrcConfig = field(default_factory=RrcConfig)
    inputs: InputBank = field(default_factory=new_inputs)
    state: RrcState = field(default=RrcState.OFF, init=False)
    _settings: Settings = field(init=False)
    _buffer: ReceiveBuffer = field(init=False)
    _power: PowerSequence = field(init=False)
    _drive: Drive = field(init=False)
    _buzzer: Buzzer = field(init=False)
    _load: LoadAccount = field(init=False)
    _renewed: int = field(default=0, init=False)  # tick of the latest correct command
    _moved: int = field(default=0, init=False)  # tick of the latest transition
    _due_us: int = field(init=False)
    _sent: list[bytes] = field(default_factory=list, init=False)
    _commands: int = field(default=0, init=False)
    _replies: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Begin without power."""
        self.reset()

    @property
    def tick_us(self) -> int:
        """The internal period."""
        return TICK_US

    @property
    def due_us(self) -> int:
        """When anything would happen without a command."""
        return 0 if self.inputs.changed else self._due_us

    @property
    def outputs(self) -> dict[str, OutputSignal]:
        """What `read` knows."""
        return OUTPUTS

    def reset(self) -> None:
        """Forget everything but configuration and physical inputs, as a power cut does."""
        self.state = RrcState.OFF
        self._buffer = ReceiveBuffer(self.config.buffer_bytes)
        self._power, self._load = PowerSequence(self.config), LoadAccount()
        self._wipe()
        self._due_us = 0

    def read(self, name: str, /) -> int | str:
        """Look at an output, as it was left by the latest tick.

        Args:
            name: one of `outputs`.

        Returns:
            Its value.

        Raises:
            KeyError: there is none of that name.
        """
        return _READERS[name](self)

    @property
    def _pace_lines_s(self) -> int:
        now, extra_pct = self._settings, self._load.extra_pct
        if self.state in POWERED_ON:
            return pace_lines_s(stable=now.stable, status=now.status, extra_pct=extra_pct)
        return 0 if self.state is RrcState.OFF else PACE_WITHOUT_VR2

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Run one period, in the order of DECISION R28.

        Args:
            now_us: time since the rig was started, a multiple of `tick_us`.
            rx: the bytes that arrived since the latest tick.

        Returns:
            The bytes that it sends in this tick.
        """
        tick = now_us // TICK_US
        self.inputs.changed = False
        if not self.inputs["rrc_power"]:
            self.reset()
            self._due_us = NEVER
            return b""
        if self.state is RrcState.OFF:
            self._boot(tick)
        self._sent, self._commands, self._replies = [], 0, 0
        overflows = self._receive(rx) if rx else 0
        self._read_inputs(tick)
        self._work(tick)
        self._watch(tick)
        self._drive.step(tick, self.state, self._settings, self.inputs)
        self._report_and_account(tick, rx.count(b"\n"), overflows)
        running = self.state in POWERED_ON
        self._buzzer.tick(tick, self._drive.alarm_since if running else None)
        self._due_us = min(self._next_due(tick) * TICK_US, NEVER)
        return b"".join(self._sent)

    def _boot(self, tick: int) -> None:
        """Make transition 1 in the tick before, so that this one ends Initialize."""
        self.state = RrcState.INITIALIZE
        self._power.enter(self.state, tick - 1)

    def _receive(self, rx: bytes) -> int:
        """Take bytes; return how often the load account has to pay for an overflow."""
        buffer = self._buffer
        overflows, thrown = buffer.overflows, buffer.thrown_blocks
        buffer.push(rx)
        overflows, thrown = buffer.overflows - overflows, buffer.thrown_blocks - thrown
        self._sent += [Refusal(RECEIVE_BUFFER_OVERFLOW).encode()] * overflows
        return overflows + thrown

    def _read_inputs(self, tick: int) -> None:
        """Take notice of buttons, faults and time."""
        if self.state in POWERED_ON and count_button_edges(self.inputs, self._settings):
            self._choose_drive()
        event, move = self._power.step(self.state, tick, self.inputs)
        if event is not None:
            self._sent.append(Event(event).encode())
        if move is not None:
            self._move(move, tick)

    def _choose_drive(self) -> None:
        """Let the stick drive in Standby as the held buttons say (DECISION R8)."""
        mode = chosen_mode(self.inputs)
        if self.state is RrcState.STANDBY and mode != self._settings.button_mode:
            self._settings.button_mode = mode
            self._drive.gearbox.reset()

    def _work(self, tick: int) -> None:
        """Work on as many lines as the period allows."""
        quota = LINES_A_PERIOD if self.state in POWERED_ON else 1 - tick % 2
        while self._commands < quota and self._buffer:
            self._commands += 1
            self._answer(self._buffer.pop(), tick)

    def _answer(self, line: bytes, tick: int) -> None:
        """Do what a line asks for; the reply keeps to the mode it came in (DECISION R21)."""
        stable = self._settings.stable
        request = read_line(line, check_wanted=stable)
        if request is None:
            return
        if isinstance(request, Refusal):
            if line.startswith(cmd.Beep.name):  # refused for whatever reason (DECISION R9)
                self._buzzer.silence()
            self._reply(request)
        elif self._obey(request, tick):
            self._renewed = tick
            if not stable:
                self._reply(Ok(request.name.decode()))
            self._follow_up(request)
        else:
            self._reply(Refusal(request.name.decode()))

    def _obey(self, command: cmd.Command, tick: int) -> bool:
        """Carry out a command; False if it is not allowed in this state (DECISION R10)."""
        move = MOVES.get(type(command))
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
        """Send what follows the OK line (DECISION R12, R26)."""
        match command:
            case cmd.DeviceName():
                self._reply(Text(self.config.device_name))
            case cmd.Version():
                self._reply(Text(self.config.version))
            case cmd.Date():
                self._reply(Text(self.config.date))
            case cmd.PowerOff():
                self._sent.append(Event(RrcEvent.BY_HOST).encode())
            case _:
                return

    def _watch(self, tick: int) -> None:
        """Trip the watchdog (DECISION R20)."""
        ticks = self._settings.watchdog_ticks
        if ticks and self.state in POWERED_ON and tick - self._renewed >= ticks:
            self._stop_by_force(RrcEvent.BY_WATCHDOG, tick)

    def _stop_by_force(self, cause: RrcEvent, tick: int) -> None:
        self._move(Move.FORCED, tick)
        self._sent.append(Event(cause).encode())

    def _report_and_account(self, tick: int, line_feeds: int, overflows: int) -> None:
        """Send the SA line, then see whether the period was long enough for it all."""
        load, status = self._load, self._settings.status
        if self.state in POWERED_ON:
            if status:
                self._sent.append(self._status().encode())
            extra_pct = self.inputs["extra_load_pct"]
            load.spend(line_feeds, overflows, self._replies, status=status, extra_pct=extra_pct)
            if self.config.overtime and load.too_far_behind:
                self._stop_by_force(RrcEvent.BY_OVER_TIME, tick)
                self._drive.step(tick, self.state, self._settings, self.inputs)  # motors stop

    def _status(self) -> Status:
        settings, inputs = self._settings, self.inputs
        return Status(
            inputs["stick_v_pct"],
            inputs["stick_w_pct"],
            *self._drive.out_pct,
            inputs["gauge"],
            settings.speed_mode,
            settings.speed_up_count,
            settings.speed_down_count,
            settings.alarm_count,
        )

    def _reply(self, reply: Ok | Refusal | Text) -> None:
        self._replies += 1
        self._sent.append(reply.encode())

    def _move(self, move: Move, tick: int) -> bool:
        """Change the state; False if there is no such transition."""
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
        if RrcState.INITIALIZE in (self.state, state):  # what commands set in there goes, too
            self._wipe()
        self.state, self._moved = state, tick
        if state is RrcState.POWER_OFF_FINISHED:
            self._move(Move.RESTART, tick)
        return True

    def _wipe(self) -> None:
        """Reset what Initialize resets (RRC manual, state description; DECISION R5)."""
        self._settings = Settings()
        self._drive, self._buzzer = Drive(), Buzzer()

    def _next_due(self, tick: int) -> int:
        """Return the next tick at which something happens without input, `NEVER` if none does."""
        settings, running = self._settings, self.state in POWERED_ON
        busy = self._buffer or not self._load.settled or (settings.status and running)
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
}
"""What `Rrc.read` returns for each of `outputs`; only the signal that is read is computed."""
