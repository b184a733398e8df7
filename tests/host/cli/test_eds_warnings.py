from __future__ import annotations

import pytest

from tickrig.host.cli.messages import show_findings
from tickrig.wire.canopen.eds.eds_file import Finding


def test_what_is_so_in_many_sections_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    empty = [Finding("a.eds", f"200{n}", "PDOMapping is empty: 0 is taken") for n in range(3)]
    show_findings([*empty, Finding("a.eds", "", "odd"), empty[0]])
    assert capsys.readouterr().err.splitlines() == [
        "a.eds: [2000] PDOMapping is empty: 0 is taken (and 2 more like it)",
        "a.eds: odd",
    ]
