"""The golden dialogues (tests/golden/rtc_lite.json), played against the device."""

from __future__ import annotations

from typing import Any

import pytest

from tests.device.rtc_lite.bench import NodeBench
from tests.wire.rtc_lite.vectors import VECTORS, raw

BEGIN = {
    "L01": "Created",
    "L02": "Inactive",
    "L03": "Inactive",
    "L05": "Error",
    "L06": "Inactive",
    "L10": "Inactive",
}
"""What the dialogues leave unsaid; the others begin in Active."""

FAILING = {
    "L04": {"on_execute"},
    "L05": {"on_reset"},
    "L06": {"on_activated"},
    "L14": {"on_deactivated"},
}
STATES = {"C": "Created", "I": "Inactive", "A": "Active", "E": "Error", "N": "None"}


@pytest.mark.parametrize("row", VECTORS["dialogues"], ids=lambda row: row["id"])
def test_dialogue(row: dict[str, Any]) -> None:
    bench = NodeBench().enter(BEGIN.get(row["id"], "Active"))
    bench.recorder.failing |= FAILING.get(row["id"], set())
    for step in row["steps"]:
        sent = bench.push(raw(step["proxy"]))
        if row["id"] == "L12":
            sent += bench.run(99_000)
            assert sent == b""
            sent = bench.push()
        assert sent == raw(*step["device"])
    assert bench.recorder.called == row.get("calls", [])
    assert bench.state == STATES[row.get("state", "A")]


def test_all_dialogues_are_there() -> None:
    assert len(VECTORS["dialogues"]) == 14
