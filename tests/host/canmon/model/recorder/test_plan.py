from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tickrig.host.canmon.model.recorder.files import AtLimit, TriggerSpan, read_plan

RUN = Path("run.log")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (
            {"rotate": ["0M"]},
            "rotate '0M' is too small: at least 64k; rotate takes 64k, disk 1024k or more",
        ),
        ({"rotate": ["0s"]}, "rotate '0s' is too short: at least 1ms"),
        ({"rotate": ["100"]}, "rotate '100' is neither a size as 100M nor a time as 10min or 1h"),
        ({"rotate": ["5parsec"]}, "rotate '5parsec' is neither a size"),
        ({"rotate": ["1M", "2M"]}, "rotate takes one size and one time, not 1M and 2M"),
        ({"disk": "0G"}, "disk '0G' is too small: at least 1024k"),
        ({"disk": "much"}, "disk 'much' is no size: write 64k, 100M or 2G"),
        ({"at_limit": "end"}, "at-limit goes with disk"),
        ({"pre": "-1"}, "pre '-1' is neither frames as 2000 nor a time as 500ms"),
        ({"pre": "150001"}, "pre '150001': at most 150000 frames are kept"),
        ({"post": "1d"}, "post '1d' is neither frames"),
    ],
)
def test_what_is_wrong_is_one_line(settings: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=r"^\S") as caught:
        read_plan(RUN, **settings)
    assert str(caught.value).startswith(said)
    assert "\n" not in str(caught.value)


def test_mf4_is_not_recorded_in_parts() -> None:
    with pytest.raises(ValueError, match="mf4 is written as a whole"):
        read_plan(Path("run.mf4"), rotate=["1M"])
    assert not read_plan(Path("run.mf4")).numbered


def test_a_file_is_no_larger_than_a_quarter_of_the_disk_space() -> None:
    assert read_plan(RUN, disk="1M").rotate_bytes == 256 << 10
    assert read_plan(RUN, disk="1G", rotate=["1M", "1.5h"]).rotate_bytes == 1 << 20
    plan = read_plan(RUN, disk="1G", at_limit="end", rotate=["90min"])
    assert (plan.rotate_us, plan.at_limit) == (5_400_000_000, AtLimit.END)


def test_a_recording_that_waits_keeps_5_s() -> None:
    assert read_plan(RUN, waits=True).around == (
        TriggerSpan(None, 5_000_000),
        TriggerSpan(None, 5_000_000),
    )
    assert read_plan(RUN, pre="0").around == (TriggerSpan(0, None), TriggerSpan(None, 5_000_000))
    assert read_plan(RUN).around is None


@pytest.mark.parametrize("name", ["run.log", "run.asc.gz", "my.run.blf", "a b.jsonl", "run[1].log"])
def test_a_part_is_known_by_its_name(name: str) -> None:
    plan = read_plan(Path("folder", name), rotate=["1M"])
    for number in (1, 99_999, 100_000):
        part = plan.part(number)
        assert (part.parent.name, plan.number(part.name)) == ("folder", number)
    assert plan.number(plan.index.name) == plan.number(name) == plan.number("other-00001.log") == 0
