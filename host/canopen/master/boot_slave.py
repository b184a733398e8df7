"""The boot slave process of CiA 302-2 as a script, in the order of Lely's master.

Device type, identity, node state if it is to be kept alive, software, configuration,
error control. It knows no time: a `Dialogue` says it to the slave.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.dialogue import Command, Guard, Script
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.canopen.master.assignment import ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.boot_status import BootStatus
from tickrig.host.canopen.master.boot_talk import (
    TRIES,
    BootEnded,
    BootTalk,
    OnStep,
    as_hex,
    is_value,
)
from tickrig.host.canopen.master.program_update import update_program
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

GUARD_ANSWER_US: Final = 100_000
BOOT_UP_US: Final = 1_000_000
"""How long an answer to guarding, and a boot-up after a reset, are waited for."""

LOAD: Final = b"load"
"""The signature of 1011h."""

COMMUNICATION: Final = 2
"""Sub-index of 1011h for communication parameters alone; a reset communication loads them."""


@dataclass(frozen=True, slots=True)
class BootOutcome:
    """How a boot-up ended.

    Attributes:
        status: the error status.
        state: what the slave reported last, None if nothing.
    """

    status: BootStatus
    state: NmtState | None = None


class SlaveBoot:
    """One boot-up of a slave.

    Not done, as Lely's master does not: 1F20h, a DCF as text; the boot-up of a slave that
    another node configures (1F25h).

    Args:
        slave: what is expected of it.
        on_step: called with each step.
    """

    def __init__(self, slave: SlaveAssignment, on_step: OnStep) -> None:
        self._slave, self._talk = slave, BootTalk(on_step)
        self._state: NmtState | None = None

    def script(self) -> Script[BootOutcome]:
        """Boot the slave; what goes wrong is in the outcome."""
        try:
            if self._slave.boots:
                yield from self._boot()
            else:
                self._talk.record("1F81h", "bit 2 is 0", "not booted by this master")
            yield from self._start_error_control()
        except BootEnded as end:
            return BootOutcome(end.status, self._state)
        operational = self._state is NmtState.OPERATIONAL
        status = BootStatus.WAS_OPERATIONAL if operational else BootStatus.BOOTED
        return BootOutcome(status, self._state)

    def _boot(self) -> Script[None]:
        yield from self._check_identity()
        if not self._slave.reset_communication and (yield from self._is_at_work()):
            return
        if self._slave.software_version and (yield from self._check_software()):
            yield from self._boot()
            return
        if not (yield from self._is_configured()):
            yield from self._configure()

    def _check_identity(self) -> Script[None]:
        slave = self._slave
        data = yield from self._talk.read(0x1000, 0, "device type", BootStatus.NO_ANSWER, TRIES)
        self._talk.compare("1000h:00 device type", data, slave.device_type, BootStatus.DEVICE_TYPE)
        for sub, name, expected, status in (
            (1, "vendor-ID", slave.vendor_id, BootStatus.VENDOR),
            (2, "product code", slave.product_code, BootStatus.PRODUCT),
            (3, "revision number", slave.revision, BootStatus.REVISION),
            (4, "serial number", slave.serial, BootStatus.SERIAL),
        ):
            if expected:
                data = yield from self._talk.read(0x1018, sub, name, status)
                self._talk.compare(f"1018h:{sub:02X} {name}", data, expected, status)

    def _is_at_work(self) -> Script[bool]:
        """Say whether the slave is Operational; reset its communication if it is not."""
        slave, status = self._slave, BootStatus.NO_HEARTBEAT
        wait_us, what = slave.heartbeat_us, "heartbeat"
        if not wait_us:
            wait_us, status, what = GUARD_ANSWER_US, BootStatus.NO_GUARD_ANSWER, "guarding"
            yield Guard()
        state = yield from self._talk.report(f"state by {what}", wait_us, status)
        if state is NmtState.OPERATIONAL:
            self._state = state
            return True
        yield from self._reset(NmtCommand.RESET_COMMUNICATION, status)
        return False

    def _check_software(self) -> Script[bool]:
        """Compare the software; return True if it was updated."""
        expected = self._slave.software_version
        data = yield from self._talk.read(
            0x1F56, 1, "software identification", BootStatus.NO_PROGRAM_OBJECTS, TRIES
        )
        what = "1F56h:01 software identification"
        if not self._slave.program or not self._slave.reset_communication:
            self._talk.compare(what, data, expected, BootStatus.UPDATE_NOT_ALLOWED)
        elif is_value(data, expected):
            self._talk.record(what, as_hex(data), "as expected")
        else:
            self._talk.record(what, as_hex(data), f"not {expected:08X}h: to be updated")
            yield from update_program(self._talk, self._slave.program, expected)
            return True
        return False

    def _is_configured(self) -> Script[bool]:
        """Say whether the configuration of the slave is of the expected date and time."""
        date, time = self._slave.configuration_date, self._slave.configuration_time
        if not (date and time):
            return False
        for sub, name, expected, tries in ((1, "date", date, TRIES), (2, "time", time, 1)):
            what = f"1020h:{sub:02X} configuration {name}"
            data = yield from self._talk.attempt(0x1020, sub, what, tries)
            if isinstance(data, SdoFailed) or not is_value(data, expected):
                found = str(data) if isinstance(data, SdoFailed) else as_hex(data)
                self._talk.record(what, found, f"not {expected:08X}h: configured anew")
                return False
            self._talk.record(what, as_hex(data), "as expected")
        return True

    def _configure(self) -> Script[None]:
        slave = self._slave
        if slave.restore_sub:
            load = ObjectWrite(0x1011, slave.restore_sub, LOAD)
            what = f"1011h:{slave.restore_sub:02X} := load"
            yield from self._talk.write(load, BootStatus.CONFIGURATION, what=what)
            communication = slave.restore_sub == COMMUNICATION
            yield from self._reset(
                NmtCommand.RESET_COMMUNICATION if communication else NmtCommand.RESET_NODE,
                BootStatus.CONFIGURATION,
            )
        for write in slave.writes:
            yield from self._talk.write(write, BootStatus.CONFIGURATION)

    def _start_error_control(self) -> Script[None]:
        slave = self._slave
        if slave.heartbeat_us:
            self._state = yield from self._talk.report(
                "heartbeat", slave.heartbeat_us, BootStatus.NO_FIRST_HEARTBEAT, boot_up=False
            )
        elif slave.guard_us:
            yield Guard()

    def _reset(self, command: NmtCommand, status: BootStatus) -> Script[None]:
        yield Command(command)
        name = command.name.lower().replace("_", " ")
        yield from self._talk.report(f"boot-up after {name}", BOOT_UP_US, status)
