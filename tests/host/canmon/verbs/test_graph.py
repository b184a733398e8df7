from __future__ import annotations

import re
import struct
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.terminal import Terminal
from tests.host.canmon.wire import Wire
from tickrig.host.canmon.cli import main

EDS = str(Path(__file__).parents[4] / "examples/eds/epos.eds")


@pytest.fixture
def log(tmp_path: Path) -> str:
    lines = (
        f"(1600000000.{n * 1_000:06d}) can0 185#{struct.pack('<Hi', 0x237, n * n).hex()}\n"
        for n in range(41)
    )
    path = tmp_path / "run.log"
    path.write_text("".join(lines).upper().replace("CAN0", "can0"))
    return str(path)


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, ["graph", *words])


PARABOLA = """\
━ way 1.6
         │                            ⡠⠊
         │                         ⡠⠔⠉
        1┤                      ⢀⡠⠒⠁
         │                   ⢀⡠⠒⠁
         │                ⡠⠔⠉⠁
         │          ⢀⣀⠤⠔⠊⠉
        0┤⣀⣀⣀⣀⠤⠤⠤⠒⠒⠉⠁
         └┬─────────────┬───────────────
        0.00          0.02 s
"""


def test_a_slice_of_a_log_is_drawn_in_the_terminal(log: str) -> None:
    result = CliRunner(env={"COLUMNS": "40", "LINES": "11"}).invoke(
        main, ["graph", log, "way=185[2:6]s*0.001"]
    )
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout == PARABOLA


def test_an_object_is_drawn_like_the_slice_that_it_is(log: str) -> None:
    by_name = canmon(log, "a=5.position", "--eds", f"5={EDS}")
    assert by_name.stdout == canmon(log, "a=185[2:6]s").stdout
    assert by_name.stdout.startswith("━ a 1600\n")


def test_a_large_log_is_drawn_like_a_small_one(log: str, monkeypatch: pytest.MonkeyPatch) -> None:
    one_by_one = canmon(log, "185[2:6]s")
    monkeypatch.setattr("tickrig.host.canmon.sources.source.SMALL_BYTES", 0)
    at_once = canmon(log, "185[2:6]s")
    assert (at_once.stdout, at_once.stderr) == (one_by_one.stdout, "")


def test_files_are_written_as_their_names_say(log: str, tmp_path: Path) -> None:
    files = [tmp_path / f"g{suffix}" for suffix in (".svg", ".html", ".png", ".csv")]
    words = [word for file in files for word in ("-o", str(file))]
    result = canmon(log, "a=185[2:6]s", *words, "--from", "10ms", "--to", "12ms", "--at", "11ms")
    assert (result.exit_code, result.output) == (0, "")
    starts = [file.read_bytes()[:8] for file in files]
    assert starts == [b"<svg xml", b"<!doctyp", b"\x89PNG\r\n\x1a\n", b"t_s,a\n16"]
    assert files[3].read_text().splitlines()[1:] == [
        "1600000000.010000,100",
        "1600000000.011000,121",
        "1600000000.012000,144",
    ]


def test_the_values_at_a_moment_are_read_out(log: str) -> None:
    assert canmon(log, "185[2:6]s", "--at", "20ms").stdout.startswith("━ 185[2:6]s 400\n")


def test_an_axis_has_the_range_that_it_is_given(log: str) -> None:
    result = canmon(log, "185[2:6]s", "--range", "1=-4000..4000")
    assert re.search(r"^ *4000┤", result.stdout, re.MULTILINE)


def test_a_signal_without_samples_is_told(log: str) -> None:
    result = canmon(log, "185[2:6]s", "186[0]")
    assert (result.exit_code, result.stderr) == (0, "186[0]: no samples\n")


def test_a_graph_without_any_sample_ends_with_1(log: str) -> None:
    assert canmon(log, "186[0]").exit_code == 1
    for words in (["--from", "9s"], ["--from", "9", "--to", "10"]):
        result = canmon(log, "185[2:6]s", *words)
        assert result.exit_code == 1
        assert "no sample from 9 to " in result.stderr
        assert result.stderr.endswith("the samples are from 0 to 0.04 s\n")


def test_times_of_a_graph_count_from_the_first_frame_or_are_dates(log: str, tmp_path: Path) -> None:
    lines = Path(log).read_text("ascii")
    Path(log).write_text(f"(1599999999.990000) can0 705#7F\n{lines}", "ascii")
    rows = []
    for begin, end in (("20ms", "0.021"), ("1600000000.010", "1600000000.011")):
        file = tmp_path / "g.csv"
        result = canmon(log, "a=185[2:6]s", "-o", str(file), "--from", begin, "--to", end)
        assert (result.exit_code, result.output) == (0, "")
        rows.append(file.read_text("ascii").splitlines()[1:])
    assert rows[0] == rows[1] == ["1600000000.010000,100", "1600000000.011000,121"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["185"], "'185' is neither an object, as 3.position, nor a slice"),
        (["185[0]", "-o", "a.gif"], "-o a.gif: a graph is written as .svg, .html, .png, .csv"),
        (["185[0]", "--size", "9x9"], "--size '9x9' is not WIDTHxHEIGHT"),
        (["185[0]", "--range", "1=5..5"], "--range '1=5..5' is not AXIS=LOW..HIGH"),
        (["185[0]", "--range", "5"], "--range '5' is not AXIS=LOW..HIGH"),
        (["185[0]", "--from", "x"], "--from 'x' is not a time"),
        (["185[0]", "--from", "9s", "--to", "8s"], "shows nothing"),
        (["5.position", "--eds", "x"], "--eds 'x' is not NODE=FILE"),
    ],
)
def test_a_graph_that_cannot_be_is_refused(log: str, words: list[str], said: str) -> None:
    result = canmon(log, *words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert said in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_file_that_cannot_be_written_ends_with_status_3(log: str) -> None:
    result = canmon(log, "185[0]", "-o", "/nowhere/g.svg")
    assert (result.exit_code, result.stderr) == (
        3,
        "Error: /nowhere/g.svg: No such file or directory\n",
    )
    assert canmon("/nowhere/run.log", "185[0]").exit_code == 3


def test_a_png_without_matplotlib_is_refused_with_what_to_install(
    log: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    file = tmp_path / "g.png"
    result = canmon(log, "185[0]", "-o", str(file))
    said = f"Error: {file}: PNG needs matplotlib: pip install 'tickrig[plot]'\n"
    assert (result.exit_code, result.stderr, file.exists()) == (2, said, False)


@pytest.mark.realtime
def test_a_bus_is_drawn_when_its_time_is_over(wire: Wire) -> None:
    with wire.calling("185#370205000000"):
        result = canmon(wire.word, "185[2:6]s", "--for", "500ms")
    assert result.stdout.startswith("━ 185[2:6]s 5\n")


@pytest.mark.realtime
def test_a_bus_is_drawn_live_until_q_is_pressed() -> None:
    terminal = Terminal("graph", "virtual:alone", "way=185[2:6]s")
    terminal.wait_for("━ way -")
    terminal.child.send("q")
    assert terminal.end() == 0
    assert "way: no samples" in terminal.written


@pytest.mark.realtime
def test_what_a_pipe_brought_is_drawn_when_it_ends(log: str) -> None:
    terminal = Terminal("graph", "-", "way=185[2:6]s", feed=Path(log))
    assert terminal.end() == 0
    assert "━ way 1600" in terminal.text()


BUS = """\
(1600000000.000000) can0 705#00
(1600000000.010000) can0 080#
(1600000000.020000) can0 080#
(1600000000.033000) can0 080#
(1600000000.100000) can0 705#05
(1600000000.150000) can0 605#4041600000000000
(1600000000.152000) can0 585#4B41600037020000
(1600000000.200000) can0 085#3081110000000000
(1600000000.250000) can0 185#370200000000
(1600000000.300000) can0 085#0000000000000000
(1600000000.350000) can0 185#180201000000
(1600000000.400000) can0 709#7F
(1600000000.450000) can0 705#04
"""


@pytest.fixture
def bus(tmp_path: Path) -> str:
    (path := tmp_path / "bus.log").write_text(BUS)
    return str(path)


def rows(path: Path) -> list[str]:
    return path.read_text().splitlines()


def test_without_a_signal_all_are_listed(bus: str) -> None:
    result = canmon(bus, "--eds", f"5={EDS}")
    assert result.exit_code == 0, result.output
    lines = [" ".join(line.split()) for line in result.stdout.splitlines()]
    assert lines[0] == "node 5"
    assert "5.statusword tpdo1 4.44/s operation enabled, fault" in lines
    assert "5.position_actual_value tpdo1 4.44/s 0 .. 1" in lines
    assert lines[3:6] == ["5.nmt 5.emcy 5.sdo", "node 9", "9.nmt 9.emcy 9.sdo"]
    assert lines[-3:-1] == ["bus", "load sync jitter"]


def test_a_large_log_is_listed_like_a_small_one(bus: str, monkeypatch: pytest.MonkeyPatch) -> None:
    one_by_one = canmon(bus, "--eds", f"5={EDS}").stdout
    monkeypatch.setattr("tickrig.host.canmon.sources.source.SMALL_BYTES", 0)
    assert canmon(bus, "--eds", f"5={EDS}").stdout == one_by_one


@pytest.mark.parametrize(
    ("word", "meant"),
    [("5.statuswrd", "5.statusword"), ("4.statusword", "5.statusword"), ("5.nmmt", "5.nmt")],
)
def test_a_misspelt_signal_is_refused_with_the_one_that_is_near(
    bus: str, word: str, meant: str
) -> None:
    result = canmon(bus, word, "--eds", f"5={EDS}")
    assert result.exit_code == 2
    assert f"did you mean {meant!r}?" in result.stderr


def test_a_statusword_is_its_states(bus: str, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("g.csv", "g.svg", "g.html", "g.png")]
    words = [word for file in files for word in ("-o", str(file))]
    result = canmon(bus, "5.statusword", "--eds", f"5={EDS}", *words, "--title", "A <drive>")
    assert (result.exit_code, result.stdout) == (0, "")
    assert [row.split(",")[1] for row in rows(files[0])] == [
        "5.statusword",
        *("operation enabled", "operation enabled", "fault"),
    ]
    svg = files[1].read_text("utf-8")
    assert "<title>fault</title>" in svg
    assert "A &lt;drive&gt;, bus.log, 0 s is 2020-09-13" in svg
    assert '"operation enabled"' in files[2].read_text("utf-8")
    shown = CliRunner(env={"COLUMNS": "60", "LINES": "9"}).invoke(
        main, ["graph", bus, "5.statusword", "--eds", f"5={EDS}"]
    )
    assert "tatusword│▏operation enabled" in shown.stdout


def test_what_a_bus_and_its_nodes_do_are_signals(bus: str, tmp_path: Path) -> None:
    words = ("5.nmt", "5.emcy", "5.sdo", "sync jitter", "-o", str(tmp_path / "g.csv"))
    assert canmon(bus, *words).exit_code == 0
    assert rows(tmp_path / "g.csv") == [
        "t_s,5.nmt,5.emcy,5.sdo [ms],sync jitter [ms]",
        "1600000000.000000,pre-operational,,,",
        "1600000000.033000,,,,3",
        "1600000000.100000,operational,,,",
        "1600000000.152000,,,2,",
        "1600000000.200000,,8130h life guard error or heartbeat error,,",
        "1600000000.300000,,no error,,",
        "1600000000.450000,stopped,,,",
    ]


def test_a_signal_of_any_node_has_a_row_for_each(bus: str, tmp_path: Path) -> None:
    assert canmon(bus, "nmt", "-o", str(tmp_path / "g.csv")).exit_code == 0
    assert rows(tmp_path / "g.csv")[0] == "t_s,5.nmt,9.nmt"


def test_the_load_is_a_share_of_the_bit_rate(bus: str, tmp_path: Path) -> None:
    for words, head in ((("-b", "500k"), "t_s,load [%]"), ((), "t_s,load [kbit/s]")):
        assert canmon(bus, "load", "-o", str(tmp_path / "g.csv"), *words).exit_code == 0
        assert rows(tmp_path / "g.csv")[0] == head
    assert [row.partition(",")[0][-8:] for row in rows(tmp_path / "g.csv")[1:]] == [
        *("0.100000", "0.200000", "0.300000", "0.400000"),
    ]
