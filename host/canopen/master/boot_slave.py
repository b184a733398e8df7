"""The boot slave process of CiA 302-2 as a script, in the order of Lely's master.

`BootStatus` is the result of the boot-up of a slave (CiA 302-2, error status of the boot slave
process).

>>> BootStatus("D").text
'1018h:01 vendor-ID is another than expected, or cannot be read'
"""

# Theory of operation.
#
# The boot procedure is one generator, so its lines follow the order of the standard. It has no
# clock and no bus: a `NodeSession` runs it; the test master runs one per slave in parallel, `canmon
# net boot` runs one. Its parameters are in `SlaveAssignment`; it reports each step to `on_step`,
# and returns a `BootOutcome`. It raises nothing.
#
#   step                          frames to node 5               ends with, if it fails
#   device type, 4 tries          605#40001000                   B no answer, C another type
#   identity, what is expected    605#40181001 .. 04             D, M, N, O for 01h to 04h
#   state, if kept alive          705#R, or waits for 705#       E heartbeat, F guarding
#     Operational: go to error control, skip the rest            (L, a success)
#     else reset communication    000#8205, waits for 705#00     E or F
#   software, if a version        605#40561F01                   G no object, H no leave to update
#     update, then start again                                   I
#   configuration, unless 1020h   605#40201001, 02               -
#     holds the expected date
#     restore, if asked for       605#23111002 "load", a reset   J
#     the writes of 1F22h         605#2...                       J
#   error control                 waits for a heartbeat, or      K
#                                   705#R
#
# Rules. Only `BootTalk` ends the procedure: it reports the step, then raises `BootEnded` with the
# error status. The first read after a possible reset gets four attempts, others get one: a node
# that has answered exists. An expected value of 0 is not checked.
#
# Coupling. A boot-up message while the procedure runs is an answer to its own reset, or comes from
# a slave that resets by itself; `NetworkSlave` does not start a second procedure then. The retry of
# status B each second, the boot time of 1F89h and the start of the slave are policy of the master,
# not of this file.
#
# Numbers. The procedure waits 100 ms for an answer to guarding, 1 s for a boot-up after a reset,
# and the consumer heartbeat time of 1016h for a heartbeat. It polls flash status and program
# control each 100 ms, for a minute.

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, NoReturn

from tickrig.host.canopen.dialogue import AwaitReport, Guard, NmtRequest, Pause, Script
from tickrig.host.canopen.errors import SdoFailed, SdoTimeout
from tickrig.host.canopen.master.assignment import ObjectWrite, SlaveAssignment
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.canopen.nmt import NmtCommand, NmtState


class BootStatus(Enum):
    """The error status of a boot-up, by its letter. `BOOTED` has no letter."""

    BOOTED = ""
    NOT_LISTED = "A"
    NO_ANSWER = "B"
    DEVICE_TYPE = "C"
    VENDOR = "D"
    NO_HEARTBEAT = "E"
    NO_GUARD_ANSWER = "F"
    NO_PROGRAM_OBJECTS = "G"
    UPDATE_NOT_ALLOWED = "H"
    UPDATE_FAILED = "I"
    CONFIGURATION = "J"
    NO_FIRST_HEARTBEAT = "K"
    WAS_OPERATIONAL = "L"
    PRODUCT = "M"
    REVISION = "N"
    SERIAL = "O"

    @property
    def text(self) -> str:
        """The meaning of the status, in words."""
        return _TEXTS[self]

    @property
    def good(self) -> bool:
        """Whether the slave runs, because it has booted or was already Operational."""
        return self in (BootStatus.BOOTED, BootStatus.WAS_OPERATIONAL)


_TEXTS: Final = {
    BootStatus.BOOTED: "booted",
    BootStatus.NOT_LISTED: "no slave of this master (1F81h)",
    BootStatus.NO_ANSWER: "1000h device type cannot be read",
    BootStatus.DEVICE_TYPE: "1000h device type is another than expected",
    BootStatus.VENDOR: "1018h:01 vendor-ID is another than expected, or cannot be read",
    BootStatus.NO_HEARTBEAT: "to be kept alive, but no heartbeat came, or no boot-up after a reset",
    BootStatus.NO_GUARD_ANSWER: "to be kept alive, but node guarding was not answered",
    BootStatus.NO_PROGRAM_OBJECTS: "1F56h:01 software identification cannot be read",
    BootStatus.UPDATE_NOT_ALLOWED: "other software than expected, and no leave to update it",
    BootStatus.UPDATE_FAILED: "other software than expected, and its update failed",
    BootStatus.CONFIGURATION: "the configuration was not taken",
    BootStatus.NO_FIRST_HEARTBEAT: "no heartbeat within the consumer heartbeat time",
    BootStatus.WAS_OPERATIONAL: "had been Operational and was left so",
    BootStatus.PRODUCT: "1018h:02 product code is another than expected, or cannot be read",
    BootStatus.REVISION: "1018h:03 revision number is another than expected, or cannot be read",
    BootStatus.SERIAL: "1018h:04 serial number is another than expected, or cannot be read",
}


# The requests to a slave during its boot-up, reported step by step.

_TRIES: Final = 4
"""Number of attempts for a slave that may just have been reset."""

_U32: Final = 4


@dataclass(frozen=True, slots=True)
class BootStep:
    """One step of a slave's boot-up as text, for the user.

    Attributes:
        request: request that the master sent, or event that the master waited for.
        answer: answer of the slave.
        meaning: consequence of the answer for the boot-up.
    """

    request: str
    answer: str
    meaning: str

    def __str__(self) -> str:
        """Return the step in one line."""
        return f"{self.request}: {self.answer}; {self.meaning}"


_OnStep = Callable[[BootStep], None]


class BootEnded(Exception):  # noqa: N818 - how a boot-up ends, in the middle of it
    """Raised inside the boot-up of a slave to end it, because the slave cannot be booted.

    Attributes:
        status: error status, which contains the reason (CiA 302-2).
    """

    def __init__(self, status: BootStatus) -> None:
        super().__init__(status.text)
        self.status = status


class BootTalk:
    """Requests and waits during the boot-up of a slave. Each one is reported as a step.

    Args:
        on_step: function that is called with each completed step.
    """

    def __init__(self, on_step: _OnStep) -> None:
        self._on_step = on_step

    def report(
        self, what: str, wait_us: int, status: BootStatus, *, boot_up: bool = True
    ) -> Script[NmtState]:
        """Wait until the slave sends a boot-up message or its NMT state, and return this state.

        If nothing arrives in time, the boot-up ends with the given error status.
        """
        state: NmtState | None = yield AwaitReport(wait_us, boot_up)
        if state is None:
            self.fail(what, f"none within {wait_us // 1_000} ms", status)
        self.record(what, state_text(state), "goes on")
        return state

    def read(
        self, index: int, sub: int, name: str, status: BootStatus, tries: int = 1
    ) -> Script[bytes]:
        """Read an object. End the procedure if it cannot be read."""
        what = f"{index:04X}h:{sub:02X} {name}"
        data = yield from self.attempt(index, sub, what, tries)
        if isinstance(data, SdoFailed):
            self.fail(what, str(data), status)
        return data

    def attempt(self, index: int, sub: int, what: str, tries: int) -> Script[bytes | SdoFailed]:
        """Read an object, with one repetition after a time-out. Return the last error."""
        while True:
            tries -= 1
            try:
                return (yield from upload(index, sub))
            except SdoFailed as error:
                if not tries or not isinstance(error, SdoTimeout):
                    return error
            self.record(what, "no answer", "asked again")

    def write(
        self,
        write: ObjectWrite,
        status: BootStatus,
        *,
        what: str = "",
        tries: int = 1,
        answered: bool = True,
    ) -> Script[None]:
        """Write an object of the slave. If the slave refuses the write, the boot-up ends.

        Args:
            write: object and value to write.
            status: error status with which the boot-up would end.
            what: text for the reported step. By default, it is the object and the value.
            tries: number of attempts if the slave does not answer.
            answered: whether the slave must answer. If True, a missing answer ends the boot-up. If
                False, the boot-up continues without the answer.
        """
        what = what or f"{write.index:04X}h:{write.sub:02X} := {_as_hex(write.data)}"
        try:
            yield from self._download(write, what, tries)
        except SdoFailed as error:
            if isinstance(error, SdoTimeout) and not answered:
                self.record(what, "no answer", "which is allowed; goes on")
                return
            self.fail(what, str(error), status)
        self.record(what, "taken", "goes on")

    def _download(self, write: ObjectWrite, what: str, tries: int) -> Script[None]:
        for left in range(tries - 1, 0, -1):
            try:
                return (yield from download(write.index, write.sub, write.data))
            except SdoTimeout:
                self.record(what, "no answer", f"sent again, {left} more")
        return (yield from download(write.index, write.sub, write.data))

    def compare(self, what: str, data: bytes, expected: int, status: BootStatus) -> None:
        """End the boot-up if a value of the slave differs from the expected number.

        An expected number of 0 means that any value is accepted.
        """
        if expected and not _is_value(data, expected):
            self.record(what, _as_hex(data), f"not {expected:08X}h: {status.text}")
            raise BootEnded(status)
        self.record(what, _as_hex(data), "as expected" if expected else "not checked")

    def fail(self, request: str, answer: str, status: BootStatus) -> NoReturn:
        """Report a step that ends the boot-up, and end it."""
        self.record(request, answer, status.text)
        raise BootEnded(status)

    def record(self, request: str, answer: str, meaning: str) -> None:
        """Report a step."""
        self._on_step(BootStep(request, answer, meaning))


_STATES: Final = {
    NmtState.INITIALISING: "boot-up",
    NmtState.STOPPED: "Stopped",
    NmtState.OPERATIONAL: "Operational",
    NmtState.PRE_OPERATIONAL: "Pre-operational",
}


def state_text(state: NmtState) -> str:
    """Return the name of a state."""
    return _STATES[state]


def _is_value(data: bytes, expected: int) -> bool:
    """Return whether data is a number of 32 bits."""
    return len(data) == _U32 and int.from_bytes(data, "little") == expected


def _as_hex(data: bytes) -> str:
    """Return a value as a number. If it is longer than eight bytes, return its length."""
    return f"{data[::-1].hex().upper()}h" if 0 < len(data) <= 8 else f"{len(data)} bytes"


# The download of software at boot-up, as a script (CiA 302-3, program download).

DATA: Final = 0x1F50
CONTROL: Final = 0x1F51
IDENTIFICATION: Final = 0x1F56
FLASH_STATUS: Final = 0x1F57

STOP: Final = 0
_START: Final = 1
_CLEAR: Final = 3
"""Commands of program control (1F51h:01)."""

LOOK_US: Final = 100_000
_LOOKS: Final = 600
"""Number of times that flash status and program control are polled, in total for a minute."""

BUSY: Final = 0x01
"""Busy bit of the flash status. Bits 1 to 7 are an error code."""

_FAILED: Final = BootStatus.UPDATE_FAILED


def _update_program(talk: BootTalk, program: bytes, expected: int) -> Script[None]:
    """Stop and clear the program, download another program, verify it, and start it.

    Args:
        talk: requests to the slave.
        program: program to download, in segments.
        expected: expected identification of the program.

    Raises:
        BootEnded: the update failed.
    """
    yield from _stop(talk)
    yield from talk.write(_control(_CLEAR), _FAILED, what="1F51h:01 := clear", tries=_TRIES)
    what = f"1F50h:01 := {len(program)} bytes"
    yield from talk.write(ObjectWrite(DATA, 1, program), _FAILED, what=what, tries=_TRIES)
    yield from _await_flash(talk)
    data = yield from talk.read(IDENTIFICATION, 1, "software identification", _FAILED)
    talk.compare("1F56h:01 software identification", data, expected, _FAILED)
    yield from talk.write(_control(_START), _FAILED, what="1F51h:01 := start", answered=False)
    yield from _await_start(talk)


def _control(command: int) -> ObjectWrite:
    return ObjectWrite(CONTROL, 1, bytes((command,)))


def _stop(talk: BootTalk) -> Script[None]:
    """Stop the program, unless it reports that it is stopped."""
    what = "1F51h:01 program control"
    data = yield from talk.attempt(CONTROL, 1, what, 1)
    if data == bytes((STOP,)):
        talk.record(what, "stopped", "goes on")
        return
    yield from talk.write(_control(STOP), _FAILED, what="1F51h:01 := stop", answered=False)


def _await_flash(talk: BootTalk) -> Script[None]:
    """Wait until the flash is written."""
    what = "1F57h:01 flash status"
    for _ in range(_LOOKS):
        yield Pause(LOOK_US)
        data = yield from talk.attempt(FLASH_STATUS, 1, what, 1)
        if isinstance(data, SdoFailed) or len(data) != _U32 or data[0] & BUSY:
            continue
        if error := data[0] >> 1:
            talk.fail(what, f"error {error}", _FAILED)
        talk.record(what, "written", "goes on")
        return
    talk.fail(what, f"not written after {_LOOKS} polls", _FAILED)


def _await_start(talk: BootTalk) -> Script[None]:
    """Wait until the program runs."""
    for _ in range(_LOOKS):
        yield Pause(LOOK_US)
        data = yield from talk.read(CONTROL, 1, "program control", _FAILED, _TRIES)
        if data == bytes((_START,)):
            talk.record("1F51h:01 program control", "started", "booted from the beginning")
            return
    talk.fail("1F51h:01 program control", f"not started after {_LOOKS} polls", _FAILED)


_GUARD_ANSWER_US: Final = 100_000
_BOOT_UP_US: Final = 1_000_000
"""Time to wait for an answer to guarding, and for a boot-up after a reset."""

_LOAD: Final = b"load"
"""Signature that 1011h requires."""

_COMMUNICATION: Final = 2
"""Sub-index of 1011h for communication parameters only, which a reset communication loads."""


@dataclass(frozen=True, slots=True)
class BootOutcome:
    """Result of the boot-up of a slave.

    Attributes:
        status: error status of the boot-up (CiA 302-2). `BootStatus.BOOTED` and
            `BootStatus.WAS_OPERATIONAL` mean success.
        state: last NMT state that the slave has reported, or None if it has reported none.
    """

    status: BootStatus
    state: NmtState | None = None


class SlaveBoot:
    """The boot-up of one slave by the master, as CiA 302-2 defines it.

    Like the CANopen master of the Lely library, this class lacks two functions:

    - the object 1F20h, which contains a DCF as text
    - the boot-up of a slave that another node configures (1F25h)

    Args:
        slave: settings that the master has for the slave, such as its expected identity.
        on_step: function that is called with each completed step.
    """

    def __init__(self, slave: SlaveAssignment, on_step: _OnStep) -> None:
        self._slave, self._talk = slave, BootTalk(on_step)
        self._state: NmtState | None = None

    def script(self) -> Script[BootOutcome]:
        """Boot the slave. Errors are in the outcome."""
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
        data = yield from self._talk.read(0x1000, 0, "device type", BootStatus.NO_ANSWER, _TRIES)
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
        """Return whether the slave is Operational. Reset its communication if it is not."""
        slave, status = self._slave, BootStatus.NO_HEARTBEAT
        wait_us, what = slave.heartbeat_us, "heartbeat"
        if not wait_us:
            wait_us, status, what = _GUARD_ANSWER_US, BootStatus.NO_GUARD_ANSWER, "guarding"
            yield Guard()
        state = yield from self._talk.report(f"state by {what}", wait_us, status)
        if state is NmtState.OPERATIONAL:
            self._state = state
            return True
        yield from self._reset(NmtCommand.RESET_COMMUNICATION, status)
        return False

    def _check_software(self) -> Script[bool]:
        """Compare the software. Return True if the software was updated."""
        expected = self._slave.software_version
        data = yield from self._talk.read(
            0x1F56, 1, "software identification", BootStatus.NO_PROGRAM_OBJECTS, _TRIES
        )
        what = "1F56h:01 software identification"
        if not self._slave.program or not self._slave.reset_communication:
            self._talk.compare(what, data, expected, BootStatus.UPDATE_NOT_ALLOWED)
        elif _is_value(data, expected):
            self._talk.record(what, _as_hex(data), "as expected")
        else:
            self._talk.record(what, _as_hex(data), f"not {expected:08X}h: to be updated")
            yield from _update_program(self._talk, self._slave.program, expected)
            return True
        return False

    def _is_configured(self) -> Script[bool]:
        """Return whether the configuration of the slave has the expected date and time."""
        date, time = self._slave.configuration_date, self._slave.configuration_time
        if not (date and time):
            return False
        for sub, name, expected, tries in ((1, "date", date, _TRIES), (2, "time", time, 1)):
            what = f"1020h:{sub:02X} configuration {name}"
            data = yield from self._talk.attempt(0x1020, sub, what, tries)
            if isinstance(data, SdoFailed) or not _is_value(data, expected):
                found = str(data) if isinstance(data, SdoFailed) else _as_hex(data)
                self._talk.record(what, found, f"not {expected:08X}h: configuring again")
                return False
            self._talk.record(what, _as_hex(data), "as expected")
        return True

    def _configure(self) -> Script[None]:
        slave = self._slave
        if slave.restore_sub:
            load = ObjectWrite(0x1011, slave.restore_sub, _LOAD)
            what = f"1011h:{slave.restore_sub:02X} := load"
            yield from self._talk.write(load, BootStatus.CONFIGURATION, what=what)
            communication = slave.restore_sub == _COMMUNICATION
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
        yield NmtRequest(command)
        name = command.name.lower().replace("_", " ")
        yield from self._talk.report(f"boot-up after {name}", _BOOT_UP_US, status)
