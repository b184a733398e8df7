"""A foreign package with the decoder, rule and tab of docs/howto/extending.md, and broken ones."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.tui.pilot import drive_session, on_monitor
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.extensions import make_decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.tui.app import MonitorApp
from tickrig.host.canmon.tui.panels.panel import TABS, make_panels
from tickrig.wire.can import CanFrame

PAGE = Path(__file__).parents[3] / "docs" / "howto/extending.md"
BROKEN = """
class Fragile:
    def decode(self, record):
        raise KeyError("weight")


class Unmade:
    def __init__(self):
        raise RuntimeError("no licence")

    def decode(self, record):
        return None


class FragileRule(MaxWeight):
    name = "fragile"

    def judge(self, record, gap_us, /):
        return 1 / 0


class UnmadePanel(ScalePanel):
    def __init__(self, session):
        session.tasks.append(None)
        raise RuntimeError("no licence")


NUMBER = 3
"""
POINTS = """\
[tickrig.decoders]
scale = scale_can:Scale
max-weight = scale_can:MaxWeight
fragile = scale_can:FragileRule
unmade = scale_can:Unmade
number = scale_can:NUMBER

[tickrig.tabs]
scale = scale_can:ScalePanel
unmade = scale_can:UnmadePanel
other = scale_can:ScalePanel
number = scale_can:NUMBER
"""
LOG = "(0.000000) can0 123#1027\n(1.000000) can0 123#1127\n(2.000000) can0 124#00\n"


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = PAGE.read_text("utf-8")
    programs = re.findall(r"```python\n(.*?)```", page[page.index("## Decoders") :], re.DOTALL)
    info = tmp_path / "scale_can-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: scale-can\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(POINTS)
    (tmp_path / "scale_can.py").write_text("\n".join(programs) + BROKEN)
    (tmp_path / "run.log").write_text(LOG)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "scale_can", raising=False)
    monkeypatch.chdir(tmp_path)


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words)


def test_a_foreign_decoder_says_what_frames_mean_and_broken_ones_are_a_line_each() -> None:
    said = canmon("dump", "run.log")
    assert [line.split("  ")[-1].strip() for line in said.stdout.splitlines()] == [
        "scale weight=10000g",
        "scale weight=10001g",
        "00",
    ]
    assert sorted(said.stderr.splitlines()) == [
        "decoder 'unmade': RuntimeError: no licence",
        "decoder or rule 'number' of package scale-can (scale_can:NUMBER)"
        " is not a class with `decode`, nor a check rule",
    ]


def test_a_filter_knows_its_signals() -> None:
    assert canmon("dump", "run.log", "-L", "-F", "weight > 10000").stdout == (
        "(0000000001.000000) can0 123#1127\n"
    )


def test_a_decoder_that_raises_is_left_out_from_then_on(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import scale_can  # type: ignore[import-not-found]  # noqa: PLC0415 - installed by the fixture

    monkeypatch.setattr(scale_can, "Scale", scale_can.Fragile)
    decoder = make_decoder({})
    record = Record(0, "can0", CanFrame.parse("123#1027"))
    capsys.readouterr()
    assert [decoder.take(record).kind, decoder.take(record).kind] == ["raw", "raw"]
    assert capsys.readouterr().err == "decoder 'scale' is left out: KeyError: 'weight'\n"


def test_a_foreign_rule_is_held() -> None:
    said = canmon("check", "run.log", "--rule", "max-weight")
    assert (said.exit_code, said.stdout) == (
        1,
        "(1.000000) max-weight: 10001 g on the scale, at most 10000 g [can0 123#1127]\n",
    )


def test_a_foreign_rule_that_sees_no_frame_judges_nothing() -> None:
    Path("other.log").write_text("(0000000001.000000) can0 124#00\n")
    said = canmon("check", "other.log", "--rule", "max-weight")
    why = "nothing was judged: max-weight: no frame that it is about came"
    assert (said.exit_code, said.stderr) == (5, f"Error: {why}\n")


def test_a_foreign_rule_is_held_by_a_file() -> None:
    Path("rules.toml").write_text('rule = ["max-weight"]\n')
    assert canmon("check", "run.log", "rules.toml").exit_code == 1


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("scale", "'scale' is a decoder, no rule"),
        ("fragile", "rule 'fragile': ZeroDivisionError: division by zero"),
        (
            "heavy",
            "no decoder or rule 'heavy'; known: fragile, max-weight, number, scale, unmade;"
            " without a package it is as 'emcy never'",
        ),
    ],
)
def test_a_rule_that_cannot_be_held_is_one_line(name: str, line: str) -> None:
    said = canmon("check", "run.log", "--rule", name)
    assert (said.exit_code, said.stderr) == (2, f"Error: {line}\n")


def test_a_foreign_tab_stands_behind_ours_and_broken_ones_are_a_line_each() -> None:
    told: list[str] = []
    session = drive_session()
    panels = make_panels(session, told.append)
    assert [panel.section for panel in panels] == [*TABS.built_in, "scale"]
    assert None not in session.tasks
    assert sorted(told) == [
        "tab 'number' of package scale-can (scale_can:NUMBER) is not a Panel with a title",
        "tab 'other': its section is 'scale'",
        "tab 'unmade': RuntimeError: no licence",
    ]


def test_a_foreign_tab_is_shown() -> None:
    foreign = TABS.load("scale")
    shown: list[str] = []

    async def act(monitor: MonitorApp, pilot: Any) -> None:
        await pilot.press("1")
        monitor.refresh_view()
        await pilot.pause()
        shown.append(str(monitor.shown.query_one("LineView").lines[0]))  # type: ignore[attr-defined]

    on_monitor(drive_session(), act, panels=(foreign,))
    assert "134 frames" in shown[0]
