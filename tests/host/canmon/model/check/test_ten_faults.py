"""Ten faults in a log of our drive and our I/O module.

The options pass all of them; a rule that is written out finds each, and holds without the fault.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache, partial
from itertools import pairwise

import pytest

from tests.host.canmon.model.check.expression.held import findings
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canmon.model.check.checker import Checker
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame

NODES = {5: MODELS["epos"], 16: MODELS["f-palette"]}
OPTIONS = parse_rules(
    {
        "no_emcy": True,
        "no_sdo_abort": True,
        "no_error_frames": True,
        "no_reboot": True,
        "no_loss": True,
        "nodes": "5,16",
        "heartbeat": "5=100ms±5%",
        "max_gap": {"080": "15ms"},
        "known": "000,080,185,205,585,605,705,710,710R,190,290,390,490",
    }
)
SET_UP = (
    *("605#40001A0000000000", "605#40001A0100000000", "605#40001A0200000000"),
    *("605#2F00180201000000", "605#2B17100064000000", "710#R1"),
)
"""What TPDO1 carries; at each SYNC; a heartbeat each 100 ms; the module is guarded."""

STATE = "node 5 operational within 1s"
LENGTH = "dlc"
ANSWER = "sdo answered within 50ms"
GAP = "tpdo1 of 5 every 5ms.."
TOGGLE = "guard toggle"
VALUE = "5.position_actual_value in -1000..1000"
BIT = "5.statusword.fault never"


def asked(at_ms: int, started: bool) -> list[str]:
    """Return what the master sends at a time."""
    if at_ms < 100:
        return [SET_UP[at_ms // 10 - 1]] if at_ms // 10 <= len(SET_UP) else []
    texts = ["080#"]
    texts += ["000#0105"] * (at_ms == 200 and started)
    texts += ["605#4000100000000000", "710#R1"] * (at_ms % 100 == 50)
    return texts


@cache
def trace(started: bool = True) -> tuple[Record, ...]:
    """Return two seconds of traffic in virtual time."""
    wire, records = CanWire(1_000_000), list[Record]()
    wire.observers.append(lambda at_us, frame: records.append(Record(at_us, "can0", frame)))
    slaves = [
        make_slave(model.dictionary(), node, application=model.application)
        for node, model in NODES.items()
    ]
    rig, master = Rig(*(Station(slave, wire.end()) for slave in slaves)), wire.end()
    for at_ms in range(10, 2_000, 10):
        rig.run_to(at_ms * 1_000)
        master.send(rig.now_us, tuple(map(CanFrame.parse, asked(at_ms, started))))
    return tuple(records)


def place(can_id: int, after_us: int = 1_000_000) -> int:
    """Return the place of the first data frame of a CAN-ID after a time."""
    return next(
        at
        for at, record in enumerate(trace())
        if record.at_us > after_us
        and isinstance(record.frame, CanFrame)
        and (record.frame.can_id, record.frame.remote) == (can_id, False)
    )


def changed(can_id: int, change: Callable[[bytes], bytes]) -> list[Record]:
    """Return the log with other data in one frame."""
    records, at = list(trace()), place(can_id)
    record = records[at]
    assert isinstance(record.frame, CanFrame)
    records[at] = record._replace(frame=CanFrame(can_id, change(record.frame.data)))
    return records


def longer(data: bytes) -> bytes:
    return data + b"\0"


def shorter(data: bytes) -> bytes:
    return data[:-1]


def with_byte(place: int, bits: int, data: bytes) -> bytes:
    return bytes(byte ^ bits * (at == place) for at, byte in enumerate(data))


def without(can_id: int) -> list[Record]:
    """Return the log without one frame."""
    records = list(trace())
    del records[place(can_id)]
    return records


def doubled(can_id: int) -> list[Record]:
    """Return the log with a frame sent again 1 ms after it."""
    record = trace()[place(can_id)]
    again = record._replace(at_us=record.at_us + 1_000)
    return sorted([*trace(), again], key=lambda one: one.at_us)


FAULTS: dict[str, tuple[str, Callable[[], Iterable[Record]], int | None, str]] = {
    "NMT state": (STATE, partial(trace, False), None, "no node 5 operational in 1000.0 ms"),
    "DLC of a PDO": (
        LENGTH,
        partial(changed, 0x185, shorter),
        0x185,
        "tpdo1 of node 5 has 5 B, 6 is right by its mapping",
    ),
    "DLC of a heartbeat": (
        LENGTH,
        partial(changed, 0x705, longer),
        0x705,
        "heartbeat of node 5 has 2 B, 1 is right",
    ),
    "DLC of SYNC": (
        LENGTH,
        partial(changed, 0x080, lambda data: bytes(2)),
        0x080,
        "sync has 2 B, 0 or 1 is right",
    ),
    "DLC of SDO": (
        LENGTH,
        partial(changed, 0x585, shorter),
        0x585,
        "sdo of node 5 has 7 B, 8 is right",
    ),
    "unanswered SDO": (
        ANSWER,
        partial(without, 0x585),
        0x605,
        "sdo of node 5: upload of 1000h:00 asked for: not answered in 50.000 ms",
    ),
    "minimum gap": (
        GAP,
        partial(doubled, 0x185),
        0x185,
        "node 5: 1.000 ms after the one before, at least 5.000 is right",
    ),
    "toggle bit": (
        TOGGLE,
        partial(changed, 0x710, partial(with_byte, 0, 0x80)),
        0x710,
        "guard of node 16: pre-operational, toggle 1: toggle 0 is right",
    ),
    "signal value": (
        VALUE,
        partial(changed, 0x185, partial(with_byte, 3, 0x40)),
        0x185,
        "tpdo1 of node 5: statusword=0x0350[switch on disabled] position_actual_value=16384;"
        " 5.position_actual_value in -1000..1000 is right",
    ),
    "bit value": (
        BIT,
        partial(changed, 0x185, partial(with_byte, 0, 0x48)),
        0x185,
        "tpdo1 of node 5: statusword=0x0318[fault] position_actual_value=0",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_that_options_pass_is_found_in_place(fault: str) -> None:
    rule, planted, can_id, text = FAULTS[fault]
    records = list(planted())
    (found, *others) = findings(rule, records)
    assert found.text == text
    assert not others or rule == TOGGLE  # the answer behind it has the wrong bit, too
    if can_id is None:
        assert found.at_us == records[0].at_us + 1_000_000
    else:
        assert found.record is not None
        assert isinstance(found.record.frame, CanFrame)
        assert found.record.frame.can_id == can_id
        assert 1_000_000 < found.record.at_us < 1_200_000
    checker = Checker(OPTIONS)
    assert [one for record in records for one in checker.take(record)] == []
    assert checker.end(records[-1].at_us) == []


@pytest.mark.parametrize("rule", [STATE, LENGTH, ANSWER, GAP, TOGGLE, VALUE, BIT])
def test_without_the_fault_the_rule_holds(rule: str) -> None:
    assert findings(rule, list(trace())) == []


def test_the_log_has_what_the_rules_speak_of() -> None:
    frames = [record.frame for record in trace() if isinstance(record.frame, CanFrame)]
    sent = {frame.can_id for frame in frames}
    assert {0x080, 0x185, 0x585, 0x605, 0x705, 0x710} <= sent
    toggles = [frame.data[0] >> 7 for frame in frames if frame.can_id == 0x710 and frame.data]
    assert toggles.count(1) > 5
    assert all(before != after for before, after in pairwise(toggles[1:]))
