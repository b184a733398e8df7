from __future__ import annotations

from pathlib import Path

from tests.host.canopen.conform.defects.cross_table import CANNOT_FAIL, cross, unseen
from tests.host.canopen.conform.defects.table import DEFECTS


def test_no_check_is_one_that_no_defect_can_fail() -> None:
    named = {check for defect in DEFECTS for check in defect.breaks}
    assert [check.id for check in unseen(named)] == []


def test_the_cross_table_tells_who_sees_a_defect() -> None:
    doubled = next(defect for defect in DEFECTS if defect.name == "boot-up doubled")
    assert [checks for _, checks in cross([doubled])] == [["NMT-01"]]


def test_the_page_tells_how_many_defects_there_are() -> None:
    text = (Path(__file__).parents[5] / "docs" / "reference/canopen/conform.md").read_text("utf-8")
    assert f"\n{len(DEFECTS)} copies of our slave have one defect each" in text
    assert f"Every check except {', '.join(CANNOT_FAIL)} finds at least one" in text
