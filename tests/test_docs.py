"""What the pages show is run, and what they point to is there."""

from __future__ import annotations

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.live import live_rrc, pty
from tickrig.host.rrc import RrcClient
from tickrig.wire.rrc.replies import RrcEvent

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "tests/hil/README.md"])


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / page).read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "docs/reference/bench/fuzzing.md",
        "docs/reference/canmon/canmon-decode.md",
        "docs/reference/canmon/canmon-logs.md",
        "docs/reference/canmon/canmon-model.md",
        "docs/reference/canmon/canmon-recording.md",
        "docs/reference/devices/canopen.md",
        "docs/reference/canopen/canopen-master.md",
        "docs/reference/canopen/conform.md",
        "docs/reference/devices/device-rtc.md",
        "docs/reference/rtc/rh3.md",
        "docs/reference/bench/scenario.md",
        "docs/reference/devices/rtc-lite.md",
        "docs/reference/rtc/rtc.md",
        "docs/reference/rtc/rtc-canopen.md",
        "docs/reference/devices/canopen-io-module.md",
        "docs/reference/devices/servo.md",
        "docs/reference/bench/signals.md",
        "docs/reference/devices/urg.md",
    ],
)
def test_the_program_of_a_page_runs(page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    exec(compile("".join(blocks(page, "python")), page, "exec"), {})


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("host", "left"), [("RrcClient.open", ("Output", 30)), ("import serial", ("Output", 0))]
)
def test_the_host_program_of_the_rrc_page_runs(host: str, left: tuple[str, int]) -> None:
    (program,) = (
        block for block in blocks("docs/reference/devices/rrc.md", "python") if host in block
    )
    with pty() as port, live_rrc(port) as rrc:
        with RrcClient.open(port.path) as client:
            rrc.set("power_button", 1)
            client.wait_for(RrcEvent.POWER_ON_SUCCESS, 3_000_000)
        program = program.replace("/tmp/rrc", port.path)
        for _ in range(2):
            exec(compile(program, "docs/reference/devices/rrc.md", "exec"), {})
        assert (rrc.read("state"), rrc.read("out_v_pct")) == left


def test_the_control_loop_of_the_rrc_page_runs() -> None:
    (program,) = (
        block for block in blocks("docs/reference/devices/rrc.md", "python") if "Bench" in block
    )
    exec(compile(program, "docs/reference/devices/rrc.md", "exec"), {})


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_every_link_and_named_test_is_there(page: Path) -> None:
    text = page.read_text("utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} points to {target}"
    for named in re.findall(r"`(tests/[\w/]+\.py)`", text):
        assert (ROOT / named).exists(), f"{page.name} names {named}"


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_paragraphs_name_no_tests(page: Path) -> None:
    """A table names them in its last column, other facts in the last section of the page."""
    text = re.sub(r"```.*?```|^\|.*$", "", page.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    assert re.findall(r"^.*\bTests?:\s+`tests?[_/].*$", text, re.MULTILINE) == []


def test_the_readme_is_short_and_its_commands_have_these_options() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    assert len(text.splitlines()) <= 120
    commands = re.findall(r"^\| [^|]+ \| `([^`]+)` \|", text, re.MULTILINE)
    assert len(commands) > 8
    ours = [words for words in map(str.split, commands) if words[0] != "pytest"]
    for program, *words in ours:
        script = Path(sys.executable).with_name(program)
        done = subprocess.run(
            [sys.executable, script, *words, "--help"], capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, ""), (program, *words)


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_nothing_stands_twice_on_a_page(page: Path) -> None:
    """Neither a line of text, nor a row of a table; programs and what they show may repeat."""
    text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
    table: list[str] = []
    for line in text.splitlines():
        table = [*table, line] if line.startswith("|") else []
        assert line not in table[:-1], f"{page.name} has a row twice: {line}"
    prose = Counter(line for line in text.splitlines() if len(line) > 60 and line[0] != "|")
    assert [line for line, count in prose.items() if count > 1] == []


def requirements() -> Iterator[tuple[str, str, str]]:
    """Yield number, state and evidence of each requirement of the sources."""
    for line in (ROOT / "docs/reference/seeds.md").read_text("utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if re.fullmatch(r"(RRC|Lite|RH3|NEDO) \d+", cells[0]):
            number, _, state, evidence = cells
            yield number, state, evidence


def test_each_requirement_of_the_sources_names_what_shows_it_or_says_why_not() -> None:
    there: Counter[str] = Counter()
    for path in (ROOT / "tests").rglob("test_*.py"):
        tests = set(
            re.findall(r"^(?:async )?def (test_\w+)", path.read_text("utf-8"), re.MULTILINE)
        )
        there.update(tests)
        there.update(f"{path.relative_to(ROOT).as_posix()}::{test}" for test in tests)
    numbers: list[str] = []
    for number, state, evidence in requirements():
        numbers.append(number)
        named = re.findall(r"`([^`]+)`", evidence)
        assert re.match(
            r"yes|in part: [\w`]|on the page|\*\*no\*\*: \w|not needed: [\w`]", state
        ), number
        assert named or re.match(r"\*\*no\*\*|not needed", state), number
        for name in named:
            assert there[name] == 1, f"{number} names {name}, of which there are {there[name]}"
    assert len(numbers) == len(set(numbers)) > 240


def decided() -> Iterator[str]:
    """Yield the decisions that a table of a page has, as K14."""
    for page in PAGES:
        letter = ""
        for line in page.read_text("utf-8").splitlines():
            first, *rest = (cell.strip() for cell in line.strip("|").split("|"))
            if [cell for cell in rest if cell] == ["decision"]:
                letter = first
            elif not line.startswith("|"):
                letter = ""
            for begin, end in re.findall(r"(\d+)(?: to (\d+))?", first) if letter else ():
                yield from (f"{letter}{n}" for n in range(int(begin), int(end or begin) + 1))
            if re.fullmatch(r"U\d+", first):
                yield first


def test_the_architecture_names_rooms_and_modules_that_are_there() -> None:
    text = (ROOT / "docs/architecture.md").read_text("utf-8")
    section = text[text.index("## Where is ...?") : text.index("## To add ...")]
    rows = re.findall(r"^\| \[([\w/]+)\]\([^)]*\) \| (.*) \|$", section, re.MULTILINE)
    named = [
        ROOT / room / name
        for room, cell in rows
        for item in cell.split("; ")
        if (head := re.match(r"(?:`\w+`(?:, )?)+(?=: )", item))
        for name in re.findall(r"\w+", head[0])
    ]
    assert len(rows) > 30
    assert len(named) > 150
    assert [path for path in named if not (path.with_suffix(".py").exists() or path.is_dir())] == []


def test_a_decision_that_is_cited_is_on_a_page() -> None:
    there = set(decided())
    assert {"K3", "K11", "L16", "R28", "U11"} <= there
    rooms = ("wire", "device", "host", "emulators")
    for path in (*PAGES, *(path for room in rooms for path in (ROOT / room).rglob("*.py"))):
        text = path.read_text("utf-8")
        cited = re.findall(r"(?:DECISION|[Dd]ecisions?) \[?([KLRU]\d+)\b", text)
        cited += re.findall(r"\[([KLRU]\d+)\]\(", text)
        assert set(cited) <= there, path
