"""The page lists the rules as they are."""

from __future__ import annotations

from typing import Final

from tests.host.canopen.data_sheet.corpus import ROOT
from tickrig.host.canopen.data_sheet.rule import RULES

PAGE: Final = (ROOT / "docs" / "reference/canmon/eds.md").read_text("utf-8")


def test_the_page_has_all_rules_in_their_order() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("| ")]
    names = [row.split(" | ")[0][2:] for row in rows]
    table = rows[names.index("rule") + 1 :]
    assert table == [
        f"| {rule.name} | {rule.severity.value} | {rule.clause} | {rule.breaks} | {rule.fix} |"
        for rule in RULES.values()
    ]
