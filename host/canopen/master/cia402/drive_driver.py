"""One axis of a drive as ros2_canopen's 402 driver drives it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final, TypeVar

from tickrig.host.canopen.dialogue import QueuedScript, Script
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.canopen.master.cia402.drive_mode import (
    MODES,
    POSITIONS,
    SPEEDS,
    DriveMode,
    DriveObject,
    HomingMode,
    ModeNumber,
)
from tickrig.host.canopen.master.cia402.drive_settings import DriveSettings
from tickrig.host.canopen.master.cia402.drive_state import (
    MODE_BITS,
    Controlword,
    DriveState,
    lead,
    next_state,
    state_of,
)
from tickrig.host.canopen.master.cia402.homing import home
from tickrig.host.canopen.master.process_image import Key, ProcessImage
from tickrig.host.canopen.master.waiting import DriveFailed, Until
from tickrig.host.canopen.sdo_transfer import download, upload

CONTROLWORD: Final = DriveObject(0x6040, 2, signed=False)
STATUSWORD: Final = DriveObject(0x6041, 2, signed=False)
MODE: Final = DriveObject(0x6060, 1)
MODE_DISPLAY: Final = DriveObject(0x6061, 1)
POSITION: Final = DriveObject(0x6064, 4)
VELOCITY: Final = DriveObject(0x606C, 4)
TORQUE: Final = DriveObject(0x6077, 2)
READ: Final = (STATUSWORD, MODE_DISPLAY, POSITION, VELOCITY, TORQUE)
"""In each period."""

HOMING_METHOD: Final = DriveObject(0x6098, 1)
SUPPORTED: Final = DriveObject(0x6502, 4, signed=False)

AXIS: Final = 0x800
"""From the objects of an axis to those of the next."""

CAUGHT_UP: Final = 3
"""So many statuswords after an answer, one is of after all that was sent before."""

SWITCH_US: Final = 5_000_000
"""How long a change of state or of mode may take."""

T = TypeVar("T")


class DriveDriver:
    """Reads and writes an axis in each period; its async operations wait for what comes of that.

    `CanopenMaster.perform` runs them: `master.perform(arm.init())`.

    `halt` is a quick stop. While the mode has no set-point, bit 8 halts the drive.

    Args:
        settings: how it is driven.
        image: what PDOs carry; all else goes by SDO.
        talk: takes what is to be said to the node by SDO.

    Attributes:
        name: of the joint.
        statusword: as it was read last.
        controlword: as it was written last.
        mode: what the drive says that it is in, by number.
        cycles: how often it was read and written.
        refusals: what the drive refused by SDO, the first one first.
    """

    def __init__(
        self, settings: DriveSettings, image: ProcessImage, talk: Callable[[QueuedScript], None]
    ) -> None:
        self._settings, self._image, self._talk = settings, image, talk
        self._channel = settings.channel
        self.name = settings.channel.name
        self.statusword = self.controlword = self.mode = self.cycles = 0
        self.refusals: list[SdoAborted] = []
        self._missing: set[Key] = set()
        self._chosen, self._mode = ModeNumber.NONE, DriveMode()
        self._reset_fault = self._known = False

    @property
    def state(self) -> DriveState:
        """The state that the statusword says; unknown until one was read since the node booted.

        It is unknown again when the node is lost, until a statusword comes.
        """
        return state_of(self.statusword) if self._known else DriveState.UNKNOWN

    def doubt(self) -> None:
        """Know nothing of the drive's state until its next statusword."""
        self._known = False
        self._image.doubt(self._key(STATUSWORD))

    @property
    def position(self) -> float:
        """Where the joint is, in its user's units."""
        channel = self._channel
        return self._value(POSITION) * channel.scale_pos_from_dev + channel.offset_pos_from_dev

    @property
    def velocity(self) -> float:
        """How fast it is."""
        return self._value(VELOCITY) * self._channel.scale_vel_from_dev

    @property
    def effort(self) -> float:
        """The torque that it has, 0 if the drive cannot say."""
        return self._value(TORQUE) * self._channel.scale_eff_from_dev

    def set_target(self, target: float) -> None:
        """Take a set-point for the chosen mode, in the user's units; a torque in per mille.

        Raises:
            DriveFailed: the drive is not in Operation enabled.
            ValueError: no number, or a mode without a target.
        """
        if not hasattr(target, "__float__"):
            raise ValueError(f"{self.name}: {target!r} is no target: a number is wanted")
        if self.state is not DriveState.OPERATION_ENABLED:
            raise DriveFailed(f"{self.name}: no target in {self._where()}")
        channel = self._channel
        if self._chosen in POSITIONS:
            target = target * channel.scale_pos_to_dev + channel.offset_pos_to_dev
        elif self._chosen in SPEEDS:
            target *= channel.scale_vel_to_dev
        self._mode.set_target(target)

    def cycle(self) -> Script[None]:
        """Read, then write, as is done in each period."""
        for item in READ:
            yield from self._read(item)
        self.statusword, self.mode = self._value(STATUSWORD), self._value(MODE_DISPLAY)
        key = self._key(STATUSWORD)
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
            self._mode.controlword = word & MODE_BITS
            if self.mode == self._chosen:
                halted = not (yield from self._mode.write(self._write))
            else:
                self._mode.controlword = 0
            word = word & ~MODE_BITS | self._mode.controlword
            word = word if halted else word & ~Controlword.HALT
        self.controlword = word
        if self._reset_fault:
            self._reset_fault, word = False, word & ~Controlword.FAULT_RESET
        yield from self._write(CONTROLWORD, word)

    async def init(self) -> None:
        """Enable the drive, and home it if its homing method is not 0; then no mode is chosen.

        Raises:
            DriveFailed: it does not get there in time.
        """
        await Until(lambda: self.cycles > 0, SWITCH_US, f"{self.name}: the node has not booted")
        self.controlword, self._reset_fault = 0, True
        await self.switch_to(DriveState.OPERATION_ENABLED)
        if await self._supports(ModeNumber.HOMING):
            await self.choose(ModeNumber.HOMING)
            await self._home()
            await self.choose(ModeNumber.NONE)

    async def recover(self) -> None:
        """Reset a fault, and enable the drive again; the target is forgotten."""
        self._reset_fault = True
        self._mode.begin()
        await self.switch_to(DriveState.OPERATION_ENABLED)

    async def shut_down(self) -> None:
        """Choose no mode, and take the voltage away."""
        await self.choose(ModeNumber.NONE)
        await self.switch_to(DriveState.SWITCH_ON_DISABLED)

    def halt(self) -> None:
        """Stop quickly; a drive that is not in Operation enabled stays as it is."""
        state = state_of(self.statusword)
        if (word := lead(self.controlword, state, DriveState.QUICK_STOP_ACTIVE)) is not None:
            self.controlword = word

    async def switch_to(self, goal: DriveState | str) -> None:
        """Lead the drive to a state, step by step to Operation enabled, else at once.

        Args:
            goal: a state, or its words: `Switched on`.

        Raises:
            ValueError: there is no such state.
            DriveFailed: no transition leads there, or it takes too long.
        """
        goal = DriveState.of(goal)
        silent = f"{self.name}: no statusword since the node was lost, or booted"
        await Until(lambda: self._known, SWITCH_US, silent)
        while (state := self.state) is not goal:
            following = next_state(state, goal)
            word = lead(self.controlword, state, following)
            if word is None:
                raise DriveFailed(f"{self.name}: no way from {self._where()} to {goal.value}")
            self.controlword = word
            await self._leave(state, f"{self.name}: {following.value} was not reached")

    async def _leave(self, state: DriveState, complaint: str) -> None:
        await Until(lambda: self.state is not state, SWITCH_US, complaint)

    async def choose(self, mode: int | str) -> None:
        """Change the mode of operation; the drive has no target then, and is halted.

        Args:
            mode: by its number or its abbreviation: `pp`, `vl`, `pv`, `tq`, `hm`, `ip`, `csp`,
                `csv`, `cst`, `none`.

        Raises:
            ValueError: there is no such mode.
            DriveFailed: the drive has not this mode, or does not show it in time.
        """
        number = ModeNumber.of(mode)
        if number is ModeNumber.NONE:
            self._chosen, self._mode = number, DriveMode()
            await self._exchange(self._write(MODE, number))
            return
        if not await self._supports(number):
            raise DriveFailed(f"{self.name}: the drive has no mode {number} (6502h)")
        chosen = MODES[number]()
        chosen.begin()
        self._chosen, self._mode = ModeNumber.NONE, DriveMode()
        await self.switch_to(self._settings.switching_state)
        await self._exchange(self._write(MODE, number))
        await Until(
            lambda: self.mode == number,
            SWITCH_US,
            f"{self.name}: mode {number} is not shown in 6061h",
        )
        self._chosen, self._mode = number, chosen
        await self.switch_to(DriveState.OPERATION_ENABLED)

    async def _supports(self, number: ModeNumber) -> bool:
        """Say whether 6502h has a mode."""
        modes = await self._exchange(self._read(SUPPORTED))
        return bool(modes >> number - 1 & 1)

    async def _home(self) -> None:
        """Home, unless the method is 0."""
        method = await self._exchange(self._read(HOMING_METHOD))
        if method and isinstance(self._mode, HomingMode):
            await home(self.name, self._mode, self._settings.homing_us, self._catch_up)

    async def _catch_up(self) -> None:
        """Wait for statuswords of after the controlword, however late drive and bus are.

        Who has answered an SDO has the RPDOs before it; which a SYNC may still have to bring into
        force, and then a TPDO has to come.
        """
        key, late = self._key(STATUSWORD), f"{self.name}: no statusword"
        await self._next_cycle()
        await self._exchange(self._request(key))
        heard = self._image.count(key) + CAUGHT_UP
        await Until(lambda: self._image.count(key) >= heard, SWITCH_US, late)
        await self._next_cycle()

    async def _next_cycle(self) -> None:
        """Wait until the drive was read and written."""
        cycles = self.cycles
        await Until(lambda: self.cycles > cycles, SWITCH_US, f"{self.name}: the node was lost")

    def _request(self, key: Key) -> Script[None]:
        """Have the drive answer, whatever it says."""
        with suppress(SdoAborted):
            yield from upload(*key)

    async def _exchange(self, script: Script[T]) -> T:
        """Say something to the drive between two periods; return what came of it."""
        ended: list[T | Exception] = []
        lost = DriveFailed(f"{self.name}: the node was lost")
        self._talk(QueuedScript("", script, ended.append, ended.append, lambda: ended.append(lost)))
        await Until(lambda: bool(ended), SWITCH_US, f"{self.name}: no answer")
        if isinstance(ended[0], Exception):
            raise DriveFailed(f"{self.name}: {ended[0]}") from ended[0]
        return ended[0]

    def _key(self, item: DriveObject) -> Key:
        return item.index + AXIS * self._settings.axis, item.sub

    def _value(self, item: DriveObject) -> int:
        return item.value_of(self._image.read(self._key(item)))

    def _read(self, item: DriveObject) -> Script[int]:
        """Read an object by SDO, unless a TPDO carries it or the drive has it not."""
        key = self._key(item)
        if not self._image.receives(key) and key not in self._missing:
            try:
                data = yield from upload(*key)
            except SdoAborted:
                self._missing.add(key)
            else:
                self._image.learn(key, int.from_bytes(data[: item.size], "little"))
        return self._value(item)

    def _write(self, item: DriveObject, value: int) -> Script[None]:
        """Write an object by RPDO, by SDO where none carries it."""
        key, bits = self._key(item), item.bits_of(value)
        if self._image.sends(key):
            self._image.write(key, bits)
            return
        try:
            yield from download(*key, bits.to_bytes(item.size, "little"))
        except SdoAborted as error:
            self.refusals.append(error)

    def _where(self) -> str:
        return f"{self.state.value} (statusword {self.statusword:04X}h)"
