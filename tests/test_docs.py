"""What the pages show is run, and what they point to is there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from tests.host.live import live_rrc, pty
from tickrig.host.rrc import RrcClient
from tickrig.wire.rrc.replies import RrcEvent

PLACES = ("tickrig", "tickrig.device", "tickrig.host", "tickrig.rtc", "tickrig.testing")
ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "tests/hil/README.md"])


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / page).read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "docs/canmon-decode.md",
        "docs/canmon-logs.md",
        "docs/canmon-model.md",
        "docs/canmon-recording.md",
        "docs/canopen.md",
        "docs/canopen-master.md",
        "docs/conform.md",
        "docs/device-rtc.md",
        "docs/rh3.md",
        "docs/scenario.md",
        "docs/rtc-lite.md",
        "docs/rtc.md",
        "docs/rtc-canopen.md",
        "docs/canopen-io-module.md",
        "docs/servo.md",
        "docs/signals.md",
        "docs/urg.md",
    ],
)
def test_the_program_of_a_page_runs(page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile("".join(blocks(page, "python")), page, "exec"), {})


@pytest.mark.realtime
def test_the_host_program_of_the_rrc_page_runs() -> None:
    (program,) = blocks("docs/rrc.md", "python")
    with pty() as port, live_rrc(port) as rrc:
        with RrcClient.open(port.path) as client:
            rrc.set("power_button", 1)
            client.wait_for(RrcEvent.POWER_ON_SUCCESS, 3_000_000)
        exec(compile(program.replace("/tmp/rrc", port.path), "docs/rrc.md", "exec"), {})
        assert (rrc.read("state"), rrc.read("out_v_pct")) == ("Output", 30)


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_every_link_and_named_test_is_there(page: Path) -> None:
    text = page.read_text("utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} points to {target}"
    for named in re.findall(r"`(tests/[\w/]+\.py)`", text):
        assert (ROOT / named).exists(), f"{page.name} names {named}"


def test_the_api_reference_is_made_without_warnings(tmp_path: Path) -> None:
    process = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "-q", str(ROOT / "docs"), str(tmp_path / "html")],
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (process.returncode, process.stderr) == (0, "")
    for place in PLACES:
        page = tmp_path / "html" / "api" / f"{place.rpartition('.')[2]}.html"
        text = page.read_text("utf-8")
        for name in import_module(place).__all__:
            assert f'id="{place}.{name}"' in text
