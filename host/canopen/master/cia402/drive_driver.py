"""One axis of a drive, operated as ros2_canopen's 402 driver does."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, TypeVar

from tickrig.host.canopen.bus_file.bus_values import BusSlave, DriveChannel
from tickrig.host.canopen.bus_file.known_keys import SETTINGS
from tickrig.host.canopen.dialogue import QueuedScript, Script
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.canopen.master.cia402 import drive_mode, drive_state
from tickrig.host.canopen.master.network_slave import NetworkSlave
from tickrig.host.canopen.master.process_image import Key, ProcessImage
from tickrig.host.canopen.master.waiting import DriveFailed, Operation, Until
from tickrig.host.canopen.periodic_timer import PeriodicTimer
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.canopen.drive import Controlword, DriveState, Statusword, state_of
from tickrig.wire.instant import NEVER

# The settings of a drive in its bus.yml.

_DRIVE_PROFILE: Final = 402
_PERIOD_MS: Final = 10
_HOMING_S: Final = 10
_ENABLED: Final = 5

_SWITCHING_STATES: Final = {
    2: DriveState.SWITCH_ON_DISABLED,
    3: DriveState.READY_TO_SWITCH_ON,
    4: DriveState.SWITCHED_ON,
    5: DriveState.OPERATION_ENABLED,
    6: DriveState.QUICK_STOP_ACTIVE,
}
"""States of `switching_state` in a bus.yml, by number."""


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """Settings of one drive axis, as in the bus.yml.

    Attributes:
        channel: settings of the joint that the axis moves, such as its name, and the scales and
            offsets that convert its values.
        axis: number of the axis. 0 is the first axis of the device.
        switching_state: CiA 402 state to which the drive is switched before its mode of operation
            is changed.
        homing_us: longest duration of homing, in microseconds.
    """

    channel: DriveChannel
    axis: int = 0
    switching_state: DriveState = DriveState.OPERATION_ENABLED
    homing_us: int = 1_000_000 * _HOMING_S


def is_drive(slave: BusSlave) -> bool:
    """Return whether a slave is a drive, by its driver in the bus.yml or its device type."""
    if slave.driver:
        return "402" in slave.driver
    return slave.identity.device_type & 0xFFFF == _DRIVE_PROFILE


def axes_of(slave: BusSlave) -> tuple[DriveSettings, ...]:
    """Return the settings of the axes of a drive."""
    state = _SWITCHING_STATES[_number(slave, "switching_state", _ENABLED)]
    homing_us = 1_000_000 * _number(slave, "homing_timeout_seconds", _HOMING_S)
    return tuple(
        DriveSettings(channel, axis, state, homing_us)
        for axis, channel in enumerate(slave.channels)
    )


def period_us_of(slave: BusSlave) -> int:
    """Return the period in microseconds in which a drive is read and written.

    The bus.yml contains this period for the drivers of ros2_canopen, and this master uses the same
    one. The result is 0 if the drive is read and written with each SYNC.
    """
    if not _number(slave, "polling", 1):
        return 0
    return 1_000 * _number(slave, "period", _PERIOD_MS)


def _number(slave: BusSlave, key: str, default: int) -> int:
    """Return a setting, or the default if the driver does not accept the value."""
    item = slave.settings.get(key)
    value = None if item is None else SETTINGS[key].value_of(item)
    return default if value is None else value


# The course of homing, by bits 10, 12 and 13 of the statusword (CiA 402-2, homing mode).

_START_US: Final = 1_000_000
"""Time limit for the drive to be at rest before homing, and for the start of homing."""

_SEEN_US: Final = 100_000
"""Time within which a drive that has homed before shows that it homes again."""

_REACHED: Final = Statusword.TARGET_REACHED
_ATTAINED: Final = Statusword.MODE_12
_ERROR: Final = Statusword.MODE_13


async def home(
    name: str, mode: drive_mode.HomingMode, within_us: int, caught_up: Callable[[], Operation]
) -> None:
    """Start the homing of a drive, and wait until it ends. The drive must be in homing mode.

    Args:
        name: name of the joint, for messages.
        mode: homing mode of the drive.
        within_us: longest duration of homing, in microseconds.
        caught_up: function that returns an operation to await. The drive receives the latest
            controlword, and then sends a statusword. This statusword ends the operation. So it does
            not show the state before the controlword.

    Raises:
        DriveFailed: homing does not start, does not end in time, or ends with an error.
    """
    await _await(name, mode, _ERROR | _REACHED, 0, _START_US, "is not at rest")
    mode.runs = True
    try:
        if mode.status & _ATTAINED:  # set by the previous homing: the bit may fall and rise unseen
            await caught_up()
            with suppress(DriveFailed):
                await Until(lambda: not mode.status & _ATTAINED, _SEEN_US, "")
        else:
            every = _ERROR | _ATTAINED | _REACHED
            await _await(name, mode, every, _REACHED, _START_US, "did not start")
        await _await(name, mode, _ERROR | _ATTAINED, 0, within_us, "did not find home")
        await _await(name, mode, _ERROR | _REACHED, 0, within_us, "did not come to rest")
    finally:
        mode.runs = False


async def _await(  # noqa: PLR0913, PLR0917 - a row of what is awaited
    name: str, mode: drive_mode.HomingMode, mask: int, before: int, within_us: int, complaint: str
) -> None:
    """Wait until some bits have changed. Raise DriveFailed if they report an error."""
    await Until(lambda: mode.status & mask != before, within_us, f"{name}: homing {complaint}")
    if mode.status & _ERROR:
        raise DriveFailed(f"{name}: homing error (bit 13 of the statusword)")


CONTROLWORD: Final = drive_mode.DriveObject(0x6040, 2, signed=False)
_STATUSWORD: Final = drive_mode.DriveObject(0x6041, 2, signed=False)
_MODE: Final = drive_mode.DriveObject(0x6060, 1)
_MODE_DISPLAY: Final = drive_mode.DriveObject(0x6061, 1)
_POSITION: Final = drive_mode.DriveObject(0x6064, 4)
_VELOCITY: Final = drive_mode.DriveObject(0x606C, 4)
_TORQUE: Final = drive_mode.DriveObject(0x6077, 2)
READ: Final = (_STATUSWORD, _MODE_DISPLAY, _POSITION, _VELOCITY, _TORQUE)
"""Objects that are transferred in each period."""

_HOMING_METHOD: Final = drive_mode.DriveObject(0x6098, 1)
_SUPPORTED: Final = drive_mode.DriveObject(0x6502, 4, signed=False)

AXIS: Final = 0x800
"""Offset from the objects of an axis to those of the next axis."""

_CAUGHT_UP: Final = 3
"""Number of statuswords after an answer of which one was sent after all earlier requests."""

_SWITCH_US: Final = 5_000_000
"""Longest duration of a change of state or of mode."""

T = TypeVar("T")


class DriveDriver:
    """Driver that reads and writes an axis in each period. Its async operations wait for results.

    `CanopenMaster.perform` runs the operations: `master.perform(arm.init())`.

    `halt` is a quick stop. While the mode has no set-point, bit 8 halts the drive.

    Args:
        settings: settings of the axis.
        image: values in PDOs. All other values are transferred by SDO.
        talk: function that is called with each SDO script to run with the node.

    Attributes:
        name: name of the joint.
        statusword: last statusword that was read.
        controlword: last controlword that was written.
        mode: number of the mode that the drive reports.
        cycles: number of read and write cycles.
        refusals: SDO requests that the drive refused. The oldest request is first.
    """

    def __init__(
        self, settings: DriveSettings, image: ProcessImage, talk: Callable[[QueuedScript], None]
    ) -> None:
        self._settings, self._image, self._talk = settings, image, talk
        self._channel = settings.channel
        self.name = settings.channel.name
        self.statusword = self.controlword = self.mode = self.cycles = 0
        self.refusals: list[SdoAborted] = []
        self._unseen = False  # a command, by `init` or `halt`, whose effect may not be read yet
        self._missing: set[Key] = set()
        self._chosen, self._mode = drive_mode.ModeNumber.NONE, drive_mode.DriveMode()
        self._reset_fault = self._known = False

    @property
    def state(self) -> DriveState | None:
        """State of the drive (CiA 402) in its last statusword.

        After the node has booted or was lost, the state is None until the next statusword arrives.
        """
        return state_of(self.statusword) if self._known else None

    def doubt(self) -> None:
        """Treat the state of the drive as unknown until its next statusword."""
        self._known = False
        self._image.doubt(self._key(_STATUSWORD))

    @property
    def position(self) -> float:
        """Position of the joint, in units of the user."""
        channel = self._channel
        return self._value(_POSITION) * channel.scale_pos_from_dev + channel.offset_pos_from_dev

    @property
    def velocity(self) -> float:
        """Speed of the joint, in units of the user."""
        return self._value(_VELOCITY) * self._channel.scale_vel_from_dev

    @property
    def effort(self) -> float:
        """Actual torque, or 0 if the drive does not report it."""
        return self._value(_TORQUE) * self._channel.scale_eff_from_dev

    def set_target(self, target: float) -> None:
        """Set the target position, speed or torque of the drive, depending on its mode.

        A position or a speed is in the units of the user. A torque is in per mille of the rated
        torque.

        Raises:
            DriveFailed: the drive is not in the state Operation enabled.
            ValueError: the target is not a number, or the current mode has no target.
        """
        if not hasattr(target, "__float__"):
            raise ValueError(f"{self.name}: {target!r} is not a target: expected a number")
        if self.state is not DriveState.OPERATION_ENABLED:
            raise DriveFailed(f"{self.name}: no target in {self._where()}")
        channel = self._channel
        if self._chosen in drive_mode.POSITIONS:
            target = target * channel.scale_pos_to_dev + channel.offset_pos_to_dev
        elif self._chosen in drive_mode.SPEEDS:
            target *= channel.scale_vel_to_dev
        self._mode.set_target(target)

    def cycle(self) -> Script[None]:
        """Read values, then write values. The node calls this in each period."""
        for item in READ:
            yield from self._read(item)
        self.statusword, self.mode = self._value(_STATUSWORD), self._value(_MODE_DISPLAY)
        key = self._key(_STATUSWORD)
        self._known = key in self._missing or self._image.is_fresh(key)
        if self.mode == self._chosen:
            self._mode.read(self.statusword)
        yield from self._control()
        self.cycles += 1

    def _control(self) -> Script[None]:
        """Write the set-point and the controlword."""
        word = self.controlword | Controlword.HALT
        if state_of(self.statusword) is DriveState.OPERATION_ENABLED:
            halted = True
            self._mode.controlword = word & drive_state.MODE_BITS
            if self.mode == self._chosen:
                halted = not (yield from self._mode.write(self._write))
            else:
                self._mode.controlword = 0
            word = word & ~drive_state.MODE_BITS | self._mode.controlword
            word = word if halted else word & ~Controlword.HALT
        self.controlword = word
        if self._reset_fault:
            self._reset_fault, word = False, word & ~Controlword.FAULT_RESET
        yield from self._write(CONTROLWORD, word)

    async def init(self) -> None:
        """Enable the drive. If it has a homing method (6098h is not 0), also do the homing.

        Afterwards no mode of operation is selected.

        Raises:
            DriveFailed: the drive is not enabled in time, or homing fails.
        """
        await Until(lambda: self.cycles > 0, _SWITCH_US, f"{self.name}: the node has not booted")
        self.controlword, self._reset_fault, self._unseen = 0, True, True
        await self.switch_to(DriveState.OPERATION_ENABLED)
        if await self._supports(drive_mode.ModeNumber.HOMING):
            await self.choose(drive_mode.ModeNumber.HOMING)
            await self._home()
            await self.choose(drive_mode.ModeNumber.NONE)

    async def recover(self) -> None:
        """Reset a fault, and enable the drive again. The target is dropped."""
        self._reset_fault = True
        self._mode.begin()
        await self.switch_to(DriveState.OPERATION_ENABLED)

    async def shut_down(self) -> None:
        """Select no mode, and disable the voltage."""
        await self.choose(drive_mode.ModeNumber.NONE)
        await self.switch_to(DriveState.SWITCH_ON_DISABLED)

    def halt(self) -> None:
        """Stop the drive by a quick stop, if it is in the state Operation enabled."""
        state = state_of(self.statusword)
        word = drive_state.lead(self.controlword, state, DriveState.QUICK_STOP_ACTIVE)
        if word is not None:
            self.controlword, self._unseen = word, True

    async def switch_to(self, goal: DriveState | str) -> None:
        """Bring the drive to a state of CiA 402.

        The state Operation enabled is reached through the states before it. Other states are
        reached only by a single transition.

        Args:
            goal: wanted state, or its name, such as `Switched on`.

        Raises:
            ValueError: there is no state with this name.
            DriveFailed: no transition leads to the state, or the drive does not reach it in time.
        """
        goal = drive_state.state_named(goal)
        silent = f"{self.name}: no statusword since the node was lost, or booted"
        await Until(lambda: self._known, _SWITCH_US, silent)
        if self._unseen and self._key(_STATUSWORD) not in self._missing:
            await self._catch_up()  # the state read so far may be the one before the command
        self._unseen = False
        while (state := self.state) is not goal:
            following = drive_state.next_state(state, goal)
            word = drive_state.lead(self.controlword, state, following)
            if word is None:
                raise DriveFailed(f"{self.name}: no way from {self._where()} to {goal.words}")
            self.controlword = word
            await self._leave(state, f"{self.name}: {following.words} was not reached")

    async def _leave(self, state: DriveState | None, complaint: str) -> None:
        await Until(lambda: self.state is not state, _SWITCH_US, complaint)

    async def choose(self, mode: int | str) -> None:
        """Select the mode of operation. Afterwards the drive has no target, and is halted.

        Args:
            mode: number of the mode, or its abbreviation: `pp`, `vl`, `pv`, `tq`, `hm`, `ip`,
                `csp`, `csv`, `cst`, `none`.

        Raises:
            ValueError: there is no such mode.
            DriveFailed: the drive does not support this mode, or does not report it in time.
        """
        number = drive_mode.ModeNumber.of(mode)
        if number is drive_mode.ModeNumber.NONE:
            self._chosen, self._mode = number, drive_mode.DriveMode()
            await self._exchange(self._write(_MODE, number))
            return
        if not await self._supports(number):
            raise DriveFailed(f"{self.name}: the drive has no mode {number} (6502h)")
        chosen = drive_mode.MODES[number]()
        chosen.begin()
        self._chosen, self._mode = drive_mode.ModeNumber.NONE, drive_mode.DriveMode()
        await self.switch_to(self._settings.switching_state)
        await self._exchange(self._write(_MODE, number))
        await Until(
            lambda: self.mode == number,
            _SWITCH_US,
            f"{self.name}: mode {number} is not reported in 6061h",
        )
        self._chosen, self._mode = number, chosen
        await self.switch_to(DriveState.OPERATION_ENABLED)

    async def _supports(self, number: drive_mode.ModeNumber) -> bool:
        """Return whether 6502h reports that the drive supports a mode."""
        modes = await self._exchange(self._read(_SUPPORTED))
        return bool(modes >> number - 1 & 1)

    async def _home(self) -> None:
        """Home the drive, unless the homing method is 0."""
        method = await self._exchange(self._read(_HOMING_METHOD))
        if method and isinstance(self._mode, drive_mode.HomingMode):
            await home(self.name, self._mode, self._settings.homing_us, self._catch_up)

    async def _catch_up(self) -> None:
        """Wait for statuswords sent after the controlword, whatever the delay of drive and bus.

        A drive that answered an SDO has received the RPDOs sent before. The RPDOs may take effect
        only with the next SYNC. After that, a TPDO must arrive.
        """
        key, late = self._key(_STATUSWORD), f"{self.name}: no statusword"
        await self._next_cycle()
        await self._exchange(self._request(key))
        heard = self._image.count(key) + _CAUGHT_UP
        await Until(lambda: self._image.count(key) >= heard, _SWITCH_US, late)
        await self._next_cycle()

    async def _next_cycle(self) -> None:
        """Wait until the drive was read and written."""
        cycles = self.cycles
        await Until(lambda: self.cycles > cycles, _SWITCH_US, f"{self.name}: the node was lost")

    def _request(self, key: Key) -> Script[None]:
        """Make the drive answer. The content of the answer does not matter."""
        with suppress(SdoAborted):
            yield from upload(*key)

    async def _exchange(self, script: Script[T]) -> T:
        """Send something to the drive between two periods. Return the result."""
        ended: list[T | Exception] = []
        lost = DriveFailed(f"{self.name}: the node was lost")
        self._talk(QueuedScript("", script, ended.append, ended.append, lambda: ended.append(lost)))
        await Until(lambda: bool(ended), _SWITCH_US, f"{self.name}: no answer")
        if isinstance(ended[0], Exception):
            raise DriveFailed(f"{self.name}: {ended[0]}") from ended[0]
        return ended[0]

    def _key(self, item: drive_mode.DriveObject) -> Key:
        return item.index + AXIS * self._settings.axis, item.sub

    def _value(self, item: drive_mode.DriveObject) -> int:
        return item.value_of(self._image.read(self._key(item)))

    def _read(self, item: drive_mode.DriveObject) -> Script[int]:
        """Read an object by SDO, unless a TPDO carries it or the drive does not have it."""
        key = self._key(item)
        if not self._image.receives(key) and key not in self._missing:
            try:
                data = yield from upload(*key)
            except SdoAborted:
                self._missing.add(key)
            else:
                self._image.learn(key, int.from_bytes(data[: item.size], "little"))
        return self._value(item)

    def _write(self, item: drive_mode.DriveObject, value: int) -> Script[None]:
        """Write an object by RPDO, or by SDO if no RPDO carries the object."""
        key, bits = self._key(item), item.bits_of(value)
        if self._image.sends(key):
            self._image.write(key, bits)
            return
        try:
            yield from download(*key, bits.to_bytes(item.size, "little"))
        except SdoAborted as error:
            self.refusals.append(error)

    def _where(self) -> str:
        state = "unknown" if self.state is None else self.state.words
        return f"{state} (statusword {self.statusword:04X}h)"


# The axes of one node, driven in its period.

_AWAITED_US: Final = 3_000_000
"""Time that a ros2_canopen driver waits for the boot-up of its node, which is three times 1 s."""


class DriveNode:
    """A CANopen node with one or more drive axes, which are read and written in each period.

    The periods start when the node has booted. A period is skipped if SDO transfers of the previous
    period are still running.

    Args:
        slave: object of the master that communicates with the node.
        image: values of the PDOs of the node.
        axes: settings of each axis.
        period_us: period in microseconds. 0 stands for once per SYNC.

    Attributes:
        drivers: driver of each axis.
    """

    def __init__(
        self,
        slave: NetworkSlave,
        image: ProcessImage,
        axes: tuple[DriveSettings, ...],
        period_us: int,
    ) -> None:
        self._slave, self._period_us = slave, period_us
        self._lost = slave.lost
        self.drivers = tuple(DriveDriver(axis, image, self._talk) for axis in axes)
        self._timer, self._busy, self._now_us = PeriodicTimer(period_us), False, 0

    @property
    def due_us(self) -> int:
        """Time of the next call of `tick`."""
        return self._timer.due_us if self._slave.good else NEVER

    @property
    def is_booted(self) -> bool:
        """Whether the node has booted."""
        return self._slave.good

    def is_awaited(self, now_us: int) -> bool:
        """Whether the node boots and the driver still waits for it."""
        return self._slave.booting and now_us - self._slave.began_us < _AWAITED_US

    def tick(self, now_us: int, *, sync: bool) -> None:
        """Read and write the axes, if a new period begins.

        Args:
            now_us: current time in microseconds.
            sync: whether a SYNC was sent just now.
        """
        self._now_us = now_us
        if self._lost != self._slave.lost or not self._slave.good:
            self._lost = self._slave.lost
            for driver in self.drivers:
                driver.doubt()
        if not self._slave.good:
            self._timer = PeriodicTimer(self._period_us)
            return
        if self._period_us and self._timer.due_us == NEVER:
            self._timer.start(now_us)
        due = self._timer.advance(now_us) if self._period_us else sync
        if due and not self._busy:
            self._busy = True
            self._talk(QueuedScript("cycle", self._cycle(), self._end, self._end, self._end))

    def _cycle(self) -> Script[None]:
        for driver in self.drivers:
            yield from driver.cycle()

    def _talk(self, script: QueuedScript) -> None:
        self._slave.dialogue.start(self._now_us, script)

    def _end(self, _result: object = None) -> None:
        self._busy = False
