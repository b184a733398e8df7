"""The boot slave process of CiA 302-2 as a script, in the order of Lely's master.

Device type, identity, node state if it is to be kept alive, software, configuration,
error control. It knows no time: a `Dialogue` says it to the slave.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.dialogue import AwaitReport, Command, Guard, Script
from tickrig.host.canopen.errors import SdoFailed, SdoTimeout
from tickrig.host.canopen.master.assignment import SlaveAssignment
from tickrig.host.canopen.master.boot_status import BootStatus
from tickrig.host.canopen.sdo_transfer import download, download_number, upload
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

TRIES: Final = 4
"""A slave that may just have been reset is asked so often."""

GUARD_ANSWER_US: Final = 100_000
BOOT_UP_US: Final = 1_000_000
"""How long an answer to guarding, and a boot-up after a reset, are waited for."""

LOAD: Final = 0x6461_6F6C
"""`load`, the signature of 1011h."""

COMMUNICATION: Final = 2
"""Sub-index of 1011h for communication parameters alone; a reset communication loads them."""

U32: Final = 4


@dataclass(frozen=True, slots=True)
class BootOutcome:
    """How a boot-up ended.

    Attributes:
        status: the error status.
        state: what the slave reported last, None if nothing.
    """

    status: BootStatus
    state: NmtState | None = None


@dataclass(frozen=True, slots=True)
class BootStep:
    """One step of a boot-up, for people.

    Attributes:
        request: what was said to the slave, or waited for.
        answer: what came.
        meaning: what follows.
    """

    request: str
    answer: str
    meaning: str

    def __str__(self) -> str:
        """Return it in a line."""
        return f"{self.request}: {self.answer}; {self.meaning}"


OnStep = Callable[[BootStep], None]


class BootEnded(Exception):  # noqa: N818 - how a boot-up ends, in the middle of it
    """The slave cannot be booted.

    Attributes:
        status: why.
    """

    def __init__(self, status: BootStatus) -> None:
        super().__init__(status.text)
        self.status = status


class SlaveBoot:
    """One boot-up of a slave.

    Not done, as Lely's master does not: 1F20h, a DCF as text; the boot-up of a slave that
    another node configures (1F25h).

    Args:
        slave: what is expected of it.
        on_step: called with each step.
    """

    def __init__(self, slave: SlaveAssignment, on_step: OnStep) -> None:
        self._slave, self._on_step = slave, on_step
        self._state: NmtState | None = None

    def script(self) -> Script[BootOutcome]:
        """Boot the slave; what goes wrong is in the outcome."""
        try:
            if self._slave.boots:
                yield from self._boot()
            else:
                self._record("1F81h", "bit 2 is 0", "not booted by this master")
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
        if self._slave.software_version:
            yield from self._check_software()
        if not (yield from self._is_configured()):
            yield from self._configure()

    def _check_identity(self) -> Script[None]:
        slave = self._slave
        data = yield from self._read(0x1000, 0, "device type", BootStatus.NO_ANSWER, TRIES)
        self._compare("1000h:00 device type", data, slave.device_type, BootStatus.DEVICE_TYPE)
        for sub, name, expected, status in (
            (1, "vendor-ID", slave.vendor_id, BootStatus.VENDOR),
            (2, "product code", slave.product_code, BootStatus.PRODUCT),
            (3, "revision number", slave.revision, BootStatus.REVISION),
            (4, "serial number", slave.serial, BootStatus.SERIAL),
        ):
            if expected:
                data = yield from self._read(0x1018, sub, name, status)
                self._compare(f"1018h:{sub:02X} {name}", data, expected, status)

    def _is_at_work(self) -> Script[bool]:
        """Say whether the slave is Operational; reset its communication if it is not."""
        slave, status = self._slave, BootStatus.NO_HEARTBEAT
        wait_us, what = slave.heartbeat_us, "heartbeat"
        if not wait_us:
            wait_us, status, what = GUARD_ANSWER_US, BootStatus.NO_GUARD_ANSWER, "guarding"
            yield Guard()
        state = yield from self._report(f"state by {what}", wait_us, status)
        if state is NmtState.OPERATIONAL:
            self._state = state
            return True
        yield from self._reset(NmtCommand.RESET_COMMUNICATION, status)
        return False

    def _check_software(self) -> Script[None]:
        expected = self._slave.software_version
        data = yield from self._read(
            0x1F56, 1, "software identification", BootStatus.NO_PROGRAM_OBJECTS, TRIES
        )
        self._compare(
            "1F56h:01 software identification", data, expected, BootStatus.UPDATE_NOT_ALLOWED
        )

    def _is_configured(self) -> Script[bool]:
        """Say whether the configuration of the slave is of the expected date and time."""
        date, time = self._slave.configuration_date, self._slave.configuration_time
        if not (date and time):
            return False
        for sub, name, expected, tries in ((1, "date", date, TRIES), (2, "time", time, 1)):
            what = f"1020h:{sub:02X} configuration {name}"
            data = yield from self._try(0x1020, sub, what, tries)
            if isinstance(data, SdoFailed) or not _is(data, expected):
                found = str(data) if isinstance(data, SdoFailed) else _hex(data)
                self._record(what, found, f"not {expected:08X}h: configured anew")
                return False
            self._record(what, _hex(data), "as expected")
        return True

    def _configure(self) -> Script[None]:
        slave = self._slave
        if slave.restore_sub:
            yield from self._write(f"1011h:{slave.restore_sub:02X} load", self._restore())
            communication = slave.restore_sub == COMMUNICATION
            yield from self._reset(
                NmtCommand.RESET_COMMUNICATION if communication else NmtCommand.RESET_NODE,
                BootStatus.CONFIGURATION,
            )
        for write in slave.writes:
            what = f"{write.index:04X}h:{write.sub:02X} := {_hex(write.data)}"
            yield from self._write(what, download(write.index, write.sub, write.data))

    def _restore(self) -> Script[None]:
        return download_number(0x1011, self._slave.restore_sub, LOAD, U32)

    def _start_error_control(self) -> Script[None]:
        slave = self._slave
        if slave.heartbeat_us:
            self._state = yield from self._report(
                "heartbeat", slave.heartbeat_us, BootStatus.NO_FIRST_HEARTBEAT, boot_up=False
            )
        elif slave.guard_us:
            yield Guard()

    def _reset(self, command: NmtCommand, status: BootStatus) -> Script[None]:
        yield Command(command)
        name = command.name.lower().replace("_", " ")
        yield from self._report(f"boot-up after {name}", BOOT_UP_US, status)

    def _report(
        self, what: str, wait_us: int, status: BootStatus, *, boot_up: bool = True
    ) -> Script[NmtState]:
        """Wait for a boot-up or a state; end the boot-up without one."""
        state: NmtState | None = yield AwaitReport(wait_us, boot_up)
        if state is None:
            self._record(what, f"none within {wait_us // 1_000} ms", status.text)
            raise BootEnded(status)
        self._record(what, _STATES[state], "goes on")
        return state

    def _read(
        self, index: int, sub: int, name: str, status: BootStatus, tries: int = 1
    ) -> Script[bytes]:
        """Read an object; end the boot-up if it cannot be read."""
        what = f"{index:04X}h:{sub:02X} {name}"
        data = yield from self._try(index, sub, what, tries)
        if isinstance(data, SdoFailed):
            self._record(what, str(data), status.text)
            raise BootEnded(status)
        return data

    def _try(self, index: int, sub: int, what: str, tries: int) -> Script[bytes | SdoFailed]:
        """Read an object, once more after a time-out; return what was raised at last."""
        for left in range(tries - 1, -1, -1):
            try:
                return (yield from upload(index, sub))
            except SdoTimeout as error:
                if not left:
                    return error
                self._record(what, "no answer", "asked again")
            except SdoFailed as error:
                return error
        raise AssertionError("a slave is asked at least once")

    def _write(self, what: str, script: Script[None]) -> Script[None]:
        try:
            yield from script
        except SdoFailed as error:
            self._record(what, str(error), BootStatus.CONFIGURATION.text)
            raise BootEnded(BootStatus.CONFIGURATION) from error
        self._record(what, "taken", "goes on")

    def _compare(self, what: str, data: bytes, expected: int, status: BootStatus) -> None:
        if expected and not _is(data, expected):
            self._record(what, _hex(data), f"not {expected:08X}h: {status.text}")
            raise BootEnded(status)
        self._record(what, _hex(data), "as expected" if expected else "not looked at")

    def _record(self, request: str, answer: str, meaning: str) -> None:
        self._on_step(BootStep(request, answer, meaning))


_STATES: Final = {
    NmtState.INITIALISING: "boot-up",
    NmtState.STOPPED: "Stopped",
    NmtState.OPERATIONAL: "Operational",
    NmtState.PRE_OPERATIONAL: "Pre-operational",
}


def _is(data: bytes, expected: int) -> bool:
    return len(data) == U32 and int.from_bytes(data, "little") == expected


def _hex(data: bytes) -> str:
    """Return a value as a number; what is longer than eight bytes as their count."""
    return f"{data[::-1].hex().upper()}h" if 0 < len(data) <= 8 else f"{len(data)} bytes"
