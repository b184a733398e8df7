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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["185"], "'185' is neither an object, as 3.position, nor a slice"),
        (["185[0]", "-o", "a.gif"], "-o a.gif: a graph is written as .svg, .html, .png, .csv"),
        (["185[0]", "--size", "9x9"], "--size '9x9' is not WIDTHxHEIGHT"),
        (["185[0]", "--range", "1=5..5"], "--range '1=5..5' is not AXIS=LOW..HIGH"),
        (["185[0]", "--range", "5"], "--range '5' is not AXIS=LOW..HIGH"),
        (["185[0]", "--from", "x"], "--from 'x' is not a time"),
        (["185[0]", "--from", "9s"], "shows nothing"),
        (["185[0]", "--eds", "x"], "--eds 'x' is not NODE=FILE"),
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
