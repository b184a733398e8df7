"""`canmon report`: the page, its data, and that nothing in a log or an EDS runs on it."""

from __future__ import annotations

import json
import random
import re
import subprocess
import sys
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tests.host.canmon.output import mutations
from tests.host.canmon.test_mutated import FD, mutated
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.columns import column_reader
from tickrig.host.canmon.output import report_page
from tickrig.host.canmon.sources import source as block_log
from tickrig.host.text import page_text

HEARTBEATS = [(n * 100_000, "703#05") for n in range(1, 60) if not 20 <= n < 30]
OTHERS = [
    (0, "703#00"),
    (10_000, "000#0103"),
    (400_000, "603#4041600000000000"),
    (401_500, "583#4B41600037020000"),
    (600_000, "603#4099990000000000"),
    (602_000, "583#8099990000000206"),
    (900_000, "083#3081110000000000"),
    *((1_000_000 + n * 10_000, f"183#{n:04X}") for n in range(300)),
    (5_500_000, "18FF0001#0102"),
    (5_600_000, "20000004#0020000000006080"),
]
LOG = "".join(
    f"({1_600_000_000 + at_us // 1_000_000}.{at_us % 1_000_000:06d}) can0 {frame}\n"
    for at_us, frame in sorted(HEARTBEATS + OTHERS)
)
MAPPING = """\
(1600000000.020000) can0 603#2F001A0000000000
(1600000000.020500) can0 583#60001A0000000000
(1600000000.021000) can0 603#23001A0110004160
(1600000000.021500) can0 583#60001A0100000000
(1600000000.022000) can0 603#2F001A0001000000
(1600000000.022500) can0 583#60001A0000000000
"""


def report(*words: object) -> Result:
    return CliRunner().invoke(main, ["report", *map(str, words)], catch_exceptions=False)


def data_of(page: Path) -> dict[str, Any]:
    """Return the data of a page."""
    found = re.search(r'id="data">(.*?)</script>', page.read_text("utf-8"), re.DOTALL)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


@pytest.fixture
def data(log: str, tmp_path: Path) -> dict[str, Any]:
    """Return the data of the page of LOG."""
    result = report(log, "-o", tmp_path / "run.html", "-b", "500k")
    assert result.exit_code == 0, result.output
    return data_of(tmp_path / "run.html")


def test_three_sentences_say_what_there_was(log: str, tmp_path: Path) -> None:
    lines = report(log, "-o", tmp_path / "run.html", "-b", "500k").stdout.splitlines()
    assert lines[0].startswith("run.log holds 358 frames of can0 in 5.90 s, from 2020-09-13 12:26")
    assert lines[1] == "1 node was present; at the end 3 is operational."
    assert re.match(r"[0-9]+ faults found; the first, at 0\.", lines[2])
    page = unescape((tmp_path / "run.html").read_text("utf-8"))
    assert " ".join(lines) in page


def test_a_lane_has_states_gaps_boot_ups_emcys_and_transfers(data: dict[str, Any]) -> None:
    (node,) = data["nodes"]
    assert node["states"] == [0, "pre-operational", 100_000, "operational"]
    assert [mark[:2] for mark in node["gaps"]] == [[1_900_000, 1_100_000]]
    assert [mark[0] for mark in node["boots"]] == [0]
    assert node["commands"][0][2] == "NMT start, node 3"
    assert node["emcys"][0][0] == 900_000
    assert node["transfers"][0][:2] == [400_000, 1_500]
    assert "object does not exist" in node["failures"][0][2]
    assert sum(node["pdos"]["at"][1::2]) == 300


def test_load_and_error_frames_are_in_bins(data: dict[str, Any]) -> None:
    (bus,) = data["buses"]
    assert bus["rate"] == 500_000
    assert bus["errors"]["at"][1::2] == [1]
    assert sum(bus["load"]["at"][1::2]) > 358 * 47


def test_a_finding_has_its_node_and_the_frames_around(data: dict[str, Any]) -> None:
    abort = next(one for one in data["findings"] if one["rule"] == "no-sdo-abort")
    assert (abort["t"], abort["at"], abort["key"]) == (602_000, [602_000], "can0/3")
    here = [frame for frame in abort["frames"] if frame[4]]
    assert [frame[2] for frame in here] == ["583#8099990000000206"]
    times = [frame[0] for frame in abort["frames"]]
    assert times == sorted(times)
    assert times[0] < 602_000 < times[-1]


def page_of(log: Path, frames: list[tuple[int, str]], *words: object) -> dict[str, Any]:
    """Return the data of the page of some frames."""
    lines = (f"({1_600_000_000 + at_us / 1e6:.6f}) can0 {frame}" for at_us, frame in sorted(frames))
    log.write_text("\n".join(lines) + "\n")
    result = report(log, "-o", log.with_suffix(".html"), *words)
    assert result.exit_code == 0, result.output
    return data_of(log.with_suffix(".html"))


@pytest.mark.parametrize("joins", [0, 31])
def test_two_nodes_with_one_id_miss_no_heartbeat(joins: int, tmp_path: Path) -> None:
    first = [(n * 100_000, "711#05") for n in range(1, 60)]
    second = [(n * 100_000 + 37_000, "711#05") for n in range(joins, 60)]
    boots = [(20_000, "711#00"), (joins * 100_000 + 5_000, "711#00")]
    data = page_of(tmp_path / "run.log", [*first, *second, *boots])
    (node,) = data["nodes"]
    rules = [one["rule"] for one in data["findings"]]
    assert "doubled-node" in rules
    assert "no-lost-heartbeat" not in rules
    assert node["gaps"] == []
    assert node["cells"][4] == "from two nodes"


@pytest.mark.parametrize(("reset", "lost"), [("000#8111", 0), ("000#8112", 1), ("000#0111", 1)])
def test_a_node_that_boots_by_itself_shows_its_silence(
    reset: str, lost: int, tmp_path: Path
) -> None:
    beats = [(n * 100_000, "711#05") for n in range(60) if not 20 <= n < 30]
    others = [(n * 100_000 + 1_000, "712#05") for n in range(60)]
    boot = [(1_950_000, reset), (2_910_000, "711#00")]
    data = page_of(tmp_path / "run.log", [*beats, *others, *boot])
    node, other = data["nodes"]
    assert [mark[:2] for mark in node["gaps"]] == [[1_900_000, 1_010_000]] * lost
    assert other["gaps"] == []
    assert [one["at"] for one in data["findings"] if one["rule"] == "no-lost-heartbeat"] == [
        [1_900_000, 2_910_000]
    ] * lost


def test_a_node_that_is_guarded_keeps_its_gaps(tmp_path: Path) -> None:
    asked = [(n * 100_000, "711#R") for n in range(60)]
    told = [
        (n * 100_000 + 1_000, f"711#{5 | n % 2 << 7:02X}") for n in range(60) if not 20 <= n < 30
    ]
    (node,) = page_of(tmp_path / "run.log", [*asked, *told])["nodes"]
    assert len(node["gaps"]) == 1


def test_an_identity_says_what_was_read_and_what_an_eds_says(tmp_path: Path) -> None:
    eds = Path(__file__).parents[4] / "examples" / "eds" / "epos.eds"
    read = [
        (n * 100_000, frame)
        for n, frame in enumerate(("605#4018100100000000", "585#43181001FB000000", "705#05"))
    ]
    (node,) = page_of(tmp_path / "run.log", read, "--eds", f"5={eds}")["nodes"]
    heard, _, from_eds = node["cells"][2].partition("; EDS: ")
    assert heard == "vendor 000000FBh"
    assert from_eds.startswith("CiA 402 drive, ")
    assert "product" in from_eds
    assert "serial" not in node["cells"][2]
    assert node["cells"][1].endswith(" (EDS)")


def test_learnt_rules_are_held(log: str, tmp_path: Path) -> None:
    good = tmp_path / "good.toml"
    learn = ["check", "--init", log, "-o", str(good)]
    assert CliRunner().invoke(main, learn).exit_code == 0
    with Path(log).open("a", encoding="ascii") as file:
        file.write("(1600000006.0) can0 1AA#01\n")
    page = tmp_path / "run.html"
    assert report(log, good, "-o", page).exit_code == 0
    found = [one["rule"] for one in data_of(page)["findings"]]
    assert "learnt-frames" in found
    assert report(log, "-o", page).exit_code == 0
    assert "learnt-frames" not in [one["rule"] for one in data_of(page)["findings"]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "No such file"),
        ("no_emcy = true\n", "no [learnt]: a report takes what canmon check --init writes"),
        ("[learnt.can0]\nspeed = 1\n", "speed"),
    ],
)
def test_other_rules_are_refused(log: str, tmp_path: Path, text: str | None, said: str) -> None:
    rules = tmp_path / "rules.toml"
    if text is not None:
        rules.write_text(text)
    result = report(log, rules, "-o", tmp_path / "run.html")
    assert result.exit_code == 2
    assert said in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_the_page_says_what_is_no_frame(log: str, tmp_path: Path) -> None:
    with Path(log).open("a", encoding="ascii") as file:
        file.write("what?\n")
    report(log, "-o", tmp_path / "run.html")
    about = [line[0] for line in data_of(tmp_path / "run.html")["about"]]
    assert any("line 359 is no frame: 'what?'" in line for line in about)


def test_a_statusword_is_drawn_as_states(tmp_path: Path) -> None:
    lines = sorted((LOG + MAPPING).splitlines(True))
    (path := tmp_path / "run.log").write_text("".join(lines).replace("183#", "183#3702"))
    report(path, "-o", tmp_path / "run.html")
    signals = data_of(tmp_path / "run.html")["signals"]
    assert [(one["name"], one["states"][1::2]) for one in signals] == [
        ("3.statusword", ["operation enabled"])
    ]


def same_page(path: Path, monkeypatch: pytest.MonkeyPatch, *words: object) -> str:
    """Write the page frame by frame and in blocks; both are the same."""
    pages = []
    page = path.with_name("run.html")
    for small, block in ((1 << 40, 1 << 20), (0, 300)):
        monkeypatch.setattr(block_log, "SMALL_BYTES", small)
        monkeypatch.setattr(column_reader, "BLOCK_BYTES", block)
        page.unlink(missing_ok=True)
        result = report(path, "-o", page, *words)
        assert 0 <= result.exit_code <= 5, result.output
        pages.append(page.read_text("utf-8") if page.exists() else result.output)
    assert pages[0] == pages[1]
    return pages[0]


def test_blocks_give_the_page_of_single_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = sorted((LOG + MAPPING).splitlines(True))
    (path := tmp_path / "run.log").write_text("".join(lines))
    assert "3.statusword" in same_page(path, monkeypatch)
    path.write_bytes((GOLDEN / "drive.log").read_bytes())
    eds = Path(__file__).parents[4] / "examples" / "eds" / "epos.eds"
    assert "5." in same_page(path, monkeypatch, "--eds", f"5={eds}", "--around", "3")


def test_a_dbc_file_names_signals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("cantools")
    path = tmp_path / "run.log"
    frames = ("123#E8030100", "18FF0001#25", "123#D0070100", "705#05")
    path.write_text("".join(f"({n}.5) can0 {frame}\n" for n, frame in enumerate(frames)))
    same_page(path, monkeypatch, "--dbc", GOLDEN / "engine.dbc")
    signals = data_of(tmp_path / "run.html")["signals"]
    assert signals


def test_standard_input_is_recorded_first(log: str, tmp_path: Path) -> None:
    canmon = "from tickrig.host.canmon.cli import main; main()"
    words = [sys.executable, "-c", canmon, "report", "-", "-o", str(tmp_path / "run.html")]
    with Path(log).open("rb") as file:
        ended = subprocess.run(words, stdin=file, capture_output=True, text=True, check=True)
    assert ended.stdout.startswith("- holds 358 frames of can0 in 5.90 s")
    assert data_of(tmp_path / "run.html")["findings"]


HOSTILE = "</script><img src=x onerror=alert(1)><!--\x1b]52;c;AAAA\x07\u202e"


def test_text_of_strangers_is_inert(tmp_path: Path) -> None:
    text = (Path(__file__).parents[4] / "examples" / "eds" / "epos.eds").read_text("latin-1")
    eds = tmp_path / "evil.eds"
    eds.write_text(re.sub("(?m)^ProductName=.*$", f"ProductName={HOSTILE}", text), "utf-8")
    path = tmp_path / "<b>&run.log"
    path.write_text(LOG.replace("can0", "<svg/onload=alert(2)>"))
    page = tmp_path / "run.html"
    report(path, "-o", page, "--eds", f"3={eds}", "--title", HOSTILE)
    written = page.read_text("utf-8")
    assert written.count("</script>") == 2
    assert not re.search(r"<(img|svg|b>)", written)
    assert "\x1b" not in written
    assert "\u202e" not in written
    assert "alert(1)" in data_of(page)["nodes"][0]["cells"][1]


def test_the_policy_lets_nothing_else_run(log: str, tmp_path: Path) -> None:
    report(log, "-o", tmp_path / "run.html")
    page = (tmp_path / "run.html").read_text("utf-8")
    folder = Path(report_page.__file__).parent
    parts = [folder.joinpath(name).read_text("utf-8") for name in ("page.css", "page.js")]
    policy = re.search(r'Security-Policy" content="(.*?)"', page)
    assert policy
    assert unescape(policy[1]) == page_text.content_policy(*parts)
    assert not re.search(r"""https?://(?!www\.w3\.org/2000/svg")|\b(?:src|href)=""", page)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "no file: give -o run.html, --pdf run.pdf or --png run.png"),
        (("--pdf", "run.png"), "--pdf run.png: the name does not end in .pdf"),
        (("-o", "/nowhere/run.html"), "-o /nowhere/run.html: no directory /nowhere"),
    ],
)
def test_wrong_files_are_refused_before_the_log_is_read(
    log: str, words: tuple[str, ...], said: str
) -> None:
    result = report(log, *words)
    assert result.exit_code == 2
    assert said in result.stderr


def test_without_chromium_a_picture_is_refused(
    log: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    result = report(log, "--pdf", tmp_path / "run.pdf")
    assert result.exit_code == 2
    assert "apt-get install chromium" in result.stderr


def test_an_empty_log_and_one_without_canopen_have_a_page(tmp_path: Path) -> None:
    (path := tmp_path / "run.log").write_text("")
    assert report(path, "-o", tmp_path / "run.html").stdout.startswith("run.log holds no frame.")
    path.write_text("(1.0) can0 18FF0001#01\n")
    assert "No CANopen node sent a frame." in report(path, "-o", tmp_path / "run.html").stdout


@pytest.mark.parametrize("seed", range(4))
def test_a_mutated_log_has_a_page_or_one_line(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chance = random.Random(seed)
    whole = (GOLDEN / "drive.log").read_bytes().splitlines(True)[:20]
    first = b"".join(whole) + FD * (seed % 2)
    for _ in range(25):
        monkeypatch.setattr(block_log, "SMALL_BYTES", chance.choice((0, 1 << 20)))
        (path := tmp_path / "run.log").write_bytes(mutated(chance, first))
        result = report(path, "-o", tmp_path / "run.html")
        assert 0 <= result.exit_code <= 5


@pytest.mark.parametrize("seed", range(4))
def test_two_thousand_mutated_logs_have_the_same_page_both_ways(seed: int) -> None:
    for number in range(500):
        mutations.judge(*mutations.mutated(random.Random(f"{seed} {number}")))


def test_a_frame_around_two_findings_is_decoded_once(tmp_path: Path) -> None:
    log, page = tmp_path / "run.log", tmp_path / "page.html"
    frames = "080# 602#2F98600063000000 582#8098600030000906 080# 082#2073210000000000 080#"
    lines = [f"(1.00{at}000) can0 {frame}\n" for at, frame in enumerate(frames.split())]
    log.write_text("".join(lines), "ascii")
    result = CliRunner().invoke(main, ["report", str(log), "-o", str(page), "--around", "2"])
    assert result.exit_code == 0, result.stderr
    assert "beginning missing" not in page.read_text("utf-8")
