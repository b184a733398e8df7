"""A sound log of four nodes of ours, and the same log with one fault each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from random import Random
from typing import Final

from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame, ErrorFrame

NODES: Final = {5: "epos", 6: "epos", 16: "f-palette", 17: "motor-core-unit"}
DRIVE, OTHER_DRIVE, MODULE, MOTOR = NODES
START_MS: Final = 300


@dataclass(frozen=True)
class Plan:
    """What differs from one sound log to another.

    Attributes:
        seed: of phases and of what the master asks for.
        length_ms: how long it is.
        sync_ms: period of SYNC.
        heartbeat_ms: of all nodes but a guarded one.
        bit_rate: of the bus.
        guarded: the module is guarded, and sends no heartbeats.
    """

    seed: int = 1
    length_ms: int = 4_000
    sync_ms: int = 10
    heartbeat_ms: int = 100
    bit_rate: int = 1_000_000
    guarded: bool = False


def _set_up(plan: Plan) -> list[str]:
    """Return the SDO requests of the start."""
    texts = []
    for node in NODES:
        texts += [f"6{node:02X}#4000100000000000", f"6{node:02X}#4018100100000000"]
        if not (plan.guarded and node == MODULE):
            beat = plan.heartbeat_ms.to_bytes(2, "little").hex()
            texts.append(f"6{node:02X}#2B171000{beat}0000")
    for node in (DRIVE, OTHER_DRIVE):
        texts += [f"6{node:02X}#40001A0{sub}00000000" for sub in range(3)]
        texts += [f"6{node:02X}#2F00180201000000"]  # TPDO1 at each SYNC
    return texts


def _polled(at_ms: int, chance: Random) -> list[str]:
    """Return what the master asks for: the state of a drive, and each 500 ms a name in segments."""
    named = at_ms % 500 // 100 == 4
    match at_ms % 100:
        case 30 if named:
            return [f"6{MODULE:02X}#4008100000000000"]
        case 30:
            return [f"6{chance.choice((DRIVE, OTHER_DRIVE)):02X}#4041600000000000"]
        case (32 | 34) as at if named:
            return [f"6{MODULE:02X}#{'60' if at == 32 else '70'}00000000000000"]
    return []


@cache
def sound(plan: Plan = Plan()) -> tuple[Record, ...]:
    """Return the traffic of four nodes and their master, in virtual time."""
    chance = Random(plan.seed)
    wire, records = CanWire(plan.bit_rate), list[Record]()
    wire.observers.append(lambda at_us, frame: records.append(Record(at_us, "can0", frame)))
    slaves = [
        make_slave(MODELS[model].dictionary(), node, application=MODELS[model].application)
        for node, model in NODES.items()
    ]
    rig, master = Rig(*(Station(slave, wire.end()) for slave in slaves)), wire.end()
    start, phase = _set_up(plan), chance.randrange(1, 1_000)
    words = iter(("0600", "0700", "0F00"))
    control = "0600"
    for at_ms in range(2, plan.length_ms):
        rig.run_to(at_ms * 1_000 + phase)
        texts: list[str] = []
        if at_ms % 5 == 0 and start:
            texts.append(start.pop(0))
        if at_ms == START_MS:
            texts.append("000#0100")
        if at_ms >= 50 and at_ms % plan.sync_ms == 0:
            texts.append("080#")
        if at_ms > START_MS and at_ms % plan.sync_ms == 1:
            if at_ms % 200 < plan.sync_ms:
                control = next(words, control)
            texts += [f"2{node:02X}#{control}00000000" for node in (DRIVE, OTHER_DRIVE)]
        if plan.guarded and at_ms % 100 == 50:
            texts.append(f"7{MODULE:02X}#R1")
        if at_ms > START_MS:
            texts += _polled(at_ms, chance)
        master.send(rig.now_us, tuple(map(CanFrame.parse, texts)))
    return tuple(records)


# The same log with one fault.

Change = Callable[[list[Record], Plan], list[Record]]


def frame_of(record: Record) -> CanFrame:
    """Return the frame of a record that has no error frame."""
    assert isinstance(record.frame, CanFrame)
    return record.frame


def places(records: Sequence[Record], can_id: int, first: str = "") -> list[int]:
    """Return the places of data frames of a CAN-ID that begin with some hex digits."""
    data = bytes.fromhex(first)
    return [
        at
        for at, record in enumerate(records)
        if isinstance(record.frame, CanFrame)
        and (record.frame.can_id, record.frame.remote) == (can_id, False)
        and record.frame.data[: len(data)] == data
    ]


def middle(records: Sequence[Record], can_id: int, first: str = "") -> int:
    """Return the place of one of them in the middle of the log."""
    found = places(records, can_id, first)
    return found[len(found) * 5 // 8]


def sorted_by_time(records: Iterable[Record]) -> list[Record]:
    """Put frames into the order of a log."""
    return sorted(records, key=lambda record: record.at_us)


def put(records: list[Record], at_us: int, *texts: str) -> list[Record]:
    """Add frames, 200 us apart."""
    new = [Record(at_us + 200 * n, "can0", CanFrame.parse(text)) for n, text in enumerate(texts)]
    return sorted_by_time([*records, *new])


def with_data(records: list[Record], at: int, data: bytes) -> list[Record]:
    """Give a frame other data."""
    can_id = frame_of(records[at]).can_id
    records[at] = records[at]._replace(frame=CanFrame(can_id, data))
    return records


def without(records: list[Record], *gone: int) -> list[Record]:
    """Leave frames out."""
    return [record for at, record in enumerate(records) if at not in gone]


def _moved(records: list[Record], can_id: int, move: Callable[[int, int], int]) -> list[Record]:
    """Move frames of a CAN-ID behind the middle of the log in time: by their count and time."""
    found = places(records, can_id)
    half = len(found) // 2
    for n, at in enumerate(found[half:]):
        records[at] = records[at]._replace(at_us=records[at].at_us + move(n, records[at].at_us))
    return sorted_by_time(records)


def _slower(records: list[Record], plan: Plan) -> list[Record]:
    found = places(records, 0x180 + DRIVE)
    return without(records, *found[len(found) // 2 :: 2])


def _jitter(records: list[Record], plan: Plan) -> list[Record]:
    chance, most = Random(plan.seed), 350 * plan.sync_ms
    return _moved(records, 0x180 + DRIVE, lambda n, at_us: chance.randrange(most))


def _busy(records: list[Record], plan: Plan) -> list[Record]:
    begin_us = 1_500_000
    step_us = 130_000_000 // plan.bit_rate
    texts = range(0, 1_200_000, step_us)
    new = [
        Record(begin_us + off, "can0", CanFrame(0x290 + off // step_us % 2, bytes(8)))
        for off in texts
    ]
    return sorted_by_time([*records, *new])


def _second_node(records: list[Record], plan: Plan) -> list[Record]:
    """A second node with the same node-ID sends its heartbeat, 37 % of a period behind."""
    off_us = plan.heartbeat_ms * 370
    found = [records[at] for at in places(records, 0x700 + MOTOR)]
    half = found[len(found) // 2 :]
    return sorted_by_time([*records, *(one._replace(at_us=one.at_us + off_us) for one in half)])


def _back(records: list[Record], plan: Plan) -> list[Record]:
    half = len(records) // 2
    return [
        record._replace(at_us=record.at_us - 250_000 * (at > half))
        for at, record in enumerate(records)
    ]


def _state(records: list[Record], plan: Plan) -> list[Record]:
    found = places(records, 0x700 + MOTOR, "05")
    for at in found[len(found) // 2 :]:
        with_data(records, at, b"\x7f")
    return records


def _repeated(records: list[Record], can_id: int, off_us: int) -> list[Record]:
    one = records[middle(records, can_id)]
    return sorted_by_time([*records, one._replace(at_us=one.at_us + off_us)])


def _toggled(records: list[Record], plan: Plan) -> list[Record]:
    at = middle(records, 0x580 + MODULE, "1B")
    return with_data(records, at, b"\x0b" + frame_of(records[at]).data[1:])


def _in_fault(records: list[Record], plan: Plan) -> list[Record]:
    at = middle(records, 0x180 + DRIVE)
    for place in [one for one in places(records, 0x180 + DRIVE) if one >= at]:
        with_data(records, place, b"\x18\x02" + frame_of(records[place]).data[2:])
    return records


def _error(records: list[Record], plan: Plan) -> list[Record]:
    frame = ErrorFrame(0x08, bytes(8))
    return sorted_by_time([*records, Record(2_000_050, "can0", frame)])


FAULTS: Final[dict[str, tuple[str, int | None, Change]]] = {
    "wrong DLC": (
        *("length", MOTOR),
        lambda records, plan: with_data(records, middle(records, 0x700 + MOTOR), b"\x05\0"),
    ),
    "SDO toggle": ("sdo-toggle", MODULE, _toggled),
    "SDO unanswered": (
        *("sdo-unanswered", MODULE),
        lambda records, plan: without(records, middle(records, 0x580 + MODULE, "41")),
    ),
    "SDO aborted": (
        *("no-sdo-abort", MODULE),
        lambda records, plan: with_data(
            records,
            middle(records, 0x580 + MODULE, "41"),
            bytes.fromhex("8008100000000206"),
        ),
    ),
    "boot-up": (
        *("no-reboot", MOTOR),
        lambda records, plan: put(records, 2_030_000, f"7{MOTOR:02X}#00"),
    ),
    "EMCY": (
        *("no-emcy", MOTOR),
        lambda records, plan: put(records, 2_030_000, f"0{0x80 + MOTOR:02X}#1023020000000000"),
    ),
    "lost heartbeat": (
        *("no-lost-heartbeat", MOTOR),
        lambda records, plan: without(records, middle(records, 0x700 + MOTOR)),
    ),
    "load": ("max-load", None, _busy),
    "error frame": ("no-error-frames", None, _error),
    "doubled node-ID": ("doubled-node", MOTOR, _second_node),
    "time back": ("time-back", None, _back),
    "state": ("nmt-state", MOTOR, _state),
    "remote frame": (
        *("remote-heartbeat", MOTOR),
        lambda records, plan: put(records, 2_030_000, f"7{MOTOR:02X}#R1"),
    ),
    "PDO length": (
        *("pdo-length", DRIVE),
        lambda records, plan: with_data(records, middle(records, 0x180 + DRIVE), bytes(5)),
    ),
    "PDO period": ("pdo-period", DRIVE, _slower),
    "PDO jitter": ("pdo-jitter", DRIVE, _jitter),
    "SYNC missing": (
        *("sync-missing", None),
        lambda records, plan: without(records, middle(records, 0x080)),
    ),
    "SYNC doubled": ("sync-doubled", None, lambda records, plan: _repeated(records, 0x080, 900)),
    "PDO missing": (
        *("pdo-missing", DRIVE),
        lambda records, plan: without(records, middle(records, 0x180 + DRIVE)),
    ),
    "PDO doubled": (
        *("pdo-doubled", DRIVE),
        lambda records, plan: _repeated(records, 0x180 + DRIVE, 700),
    ),
    "NMT stop": (
        *("nmt-stop", MOTOR),
        lambda records, plan: put(records, 3_990_000, f"000#02{MOTOR:02X}"),
    ),
    "CAN-ID once": (
        *("seen-once", None),
        lambda records, plan: put(records, 2_530_000, "3C5#0102"),
    ),
    "drive fault": ("drive-fault", DRIVE, _in_fault),
}
"""A rule, the node that is to blame, and what puts a fault for it into a log."""


def faulty(name: str, plan: Plan = Plan()) -> list[Record]:
    """Return a sound log with a fault."""
    return FAULTS[name][2](list(sound(plan)), plan)


EIGHT: Final = (
    *("EMCY", "lost heartbeat", "PDO missing", "SYNC doubled", "SDO aborted", "CAN-ID once"),
    *("remote frame", "drive fault"),
)
"""The faults of `eight_faults`."""


def eight_faults() -> list[Record]:
    """Return a sound log with eight faults."""
    records = list(sound())
    for name in EIGHT:
        records = FAULTS[name][2](records, Plan())
    return records


def candump(records: Iterable[Record]) -> str:
    """Write a log as candump does."""
    return "".join(
        f"({1_700_000_000 + one.at_us / 1e6:.6f}) {one.channel} {one.frame}\n" for one in records
    )
