"""What is found in a log without a rule: a fault each, and none where all is well."""

from __future__ import annotations

from tickrig.host.canmon.model.check.diagnosis import diagnose
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame


def test_a_heartbeat_that_is_left_out_is_found() -> None:
    beats = [Record(at * 100_000, "can0", CanFrame.parse("705#05")) for at in range(20)]
    (fault,) = diagnose([beats[:9], beats[10:]]).faults
    assert (fault.rule, fault.node, fault.first_us, fault.last_us) == (
        *("no-lost-heartbeat", 5),
        *(800_000, 1_000_000),
    )
    assert [place.number for place in fault.frames] == [9, 10]
