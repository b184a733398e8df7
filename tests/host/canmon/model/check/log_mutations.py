"""Logs of a sound bus with chance in them: frames lost, moved, changed; then bytes spoilt."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from tests.host.canmon.model.check.sound_log import FAULTS, Plan, candump, faulty
from tests.host.canmon.model.logs.mutations import frame, read
from tests.mutators import spoilt
from tickrig.host.canmon.model.check import learnt
from tickrig.host.canmon.model.check.diagnosis import RULES, Diagnoser
from tickrig.host.canmon.model.frames import Record

_FRAMES = 80
_STEPS_US = (0, 1, 200, 9_000, 100_000, 5_000_000, 10**12, -1, -9_000, -3_000_000, -(10**12))


@cache
def _faulty(name: str) -> list[Record]:
    return faulty(name, Plan(length_ms=4_200))


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return the name and the bytes of a log of which frames are changed; half are spoilt."""
    records = _faulty(chance.choice(list(FAULTS)))
    begin = chance.randrange(len(records) - _FRAMES)
    records = records[begin : begin + chance.randrange(1, _FRAMES)]
    for _ in range(chance.randrange(12)):
        at = chance.randrange(len(records))
        match chance.randrange(7):
            case 0 if len(records) > 1:
                del records[at]
            case 1:
                records.insert(at, records[chance.randrange(len(records))])
            case 2:
                at_us = max(0, records[at].at_us + chance.choice(_STEPS_US))
                records[at] = records[at]._replace(at_us=at_us)
            case 3:
                records[at] = records[at]._replace(frame=frame(chance))
            case 4:
                records[at:] = [one._replace(channel="can1") for one in records[at:]]
            case 5:
                off_us = chance.choice(_STEPS_US)
                records[at:] = [
                    one._replace(at_us=max(0, one.at_us + off_us)) for one in records[at:]
                ]
            case _:
                records += records[:at]
    data = candump(records).encode()
    return "run.log", spoilt(data, chance) if chance.random() < 0.5 else data


def judge(name: str, data: bytes) -> str:
    """Diagnose a log, learn from it, and hold what was learnt against it."""
    with TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(data)
        records, _ = read(path)
    return diagnosed(records)


def diagnosed(records: list[Record]) -> str:
    """Diagnose frames, learn from them, and hold what was learnt against them."""
    one = Diagnoser(500_000)
    one.take(records)
    found = one.diagnosis()
    for fault in found.faults:
        assert fault.rule in RULES
        assert "\n" not in str(fault)
        assert fault.amount >= 1
        for number, at_us in fault.frames:
            assert records[number - 1].at_us == at_us
            assert fault.first_us <= at_us <= fault.last_us
    text = learnt.learnt_text(one.summaries(), ["of a test"])
    if not records:
        return "empty"
    rules = learnt.parse_learnt(text)
    assert rules is not None
    again = Diagnoser(500_000, rules=rules)
    again.take(records)
    own = [fault for fault in again.diagnosis().faults if fault.rule in learnt.RULES]
    assert own == [], list(map(str, own))
    return "faulty" if found.faults else "sound"
