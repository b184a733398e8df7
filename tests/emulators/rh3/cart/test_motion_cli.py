from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import click
import pexpect
import pytest
from click.testing import CliRunner, Result

from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.emulators.rh3.commands.cart_options import MotionOptions, require_arrival
from tickrig.emulators.rh3.commands.motion_cli import main as rh3
from tickrig.emulators.rh3.commands.motion_verbs import SquarePlan, run_squares
from tickrig.host.rtc.motion.drive import BaseConnection, drive, start
from tickrig.host.rtc.motion.geometry import Pose

CORNERS = "0.5, 0  # first\n\n0.5 0.5 9\n0 0 0\n"


def run(*words: str | Path, text: str = "") -> Result:
    return CliRunner().invoke(rh3, [str(word) for word in words], input=text)


def test_goto_tells_how_well_it_went() -> None:
    result = run("goto", "0.5", "0", "0", "--set", "tuned")
    lines = result.stdout.splitlines()
    assert (result.exit_code, result.stderr) == (0, "")
    assert [line.split()[0] for line in lines] == [
        "time",
        "at",
        "cross-track",
        "turning",
        "limits",
    ]
    assert "x the least time" in lines[0]
    assert lines[-1] == "limits       kept"
    assert run("goto", "0.5", "0", "0", "--set", "tuned").stdout == result.stdout


def test_negative_coordinates_are_numbers() -> None:
    assert run("goto", "-0.2", "-0.1", "-1").exit_code == 0


def test_the_present_pose_as_goal_has_no_least_time() -> None:
    assert "x the least time" not in run("goto", "0", "0", "0").stdout


def test_path_drives_along_the_points_of_a_file(tmp_path: Path) -> None:
    file = tmp_path / "corners.txt"
    file.write_text(CORNERS)
    result = run("path", file)
    assert result.exit_code == 0
    assert result.stdout.startswith("time ")


def test_the_base_is_as_the_options_say() -> None:
    slow = run("goto", "0.3", "0", "0", "--response-s", "0.3", "--delay-ms", "60")
    assert slow.exit_code == 0
    assert slow.stdout != run("goto", "0.3", "0", "0").stdout


@pytest.mark.parametrize("suffix", ["png", "svg", "html"])
def test_a_plot_is_a_picture(suffix: str, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    file = tmp_path / f"track.{suffix}"
    assert run("goto", "0.2", "0", "0", "--plot", file).exit_code == 0
    begins = {"png": b"\x89PNG", "svg": b"<?xml", "html": b"<!DOCTYPE html>"}
    assert file.read_bytes().startswith(begins[suffix])


def test_the_map_grows_in_place() -> None:
    result = run("goto", "0.5", "0.5", "0", "--map")
    assert result.stdout.count("\x1b[17A") > 5
    assert any("\u2800" < letter < "\u28ff" for letter in result.stdout)
    assert "\x1b" not in run("goto", "0.1", "0", "0").stdout


def test_squares_calibrate_the_odometry(tmp_path: Path) -> None:
    conf = tmp_path / "Odometry.conf"
    words = ("--tread-m", "0.46", "--side", "1", "--set", "tuned")
    result = run("square", *words, "--save", conf)
    assert result.exit_code == 0
    head, systematic, back, *lines = result.stdout.splitlines()
    assert head.split() == ["before", "after"]
    before, after = map(float, systematic.split()[1:3])
    assert after < before / 5
    assert back.startswith("return, most")
    assert conf.read_text().splitlines() == lines
    assert lines[2].startswith("conf.default.lengthOfAxle: 0.45")


class OnPort(MotionOptions):
    """Options whose cart is said to be on a serial port."""

    def _connection(self) -> BaseConnection:
        return ClosedLoop()


class Jammed(MotionOptions):
    """Options whose cart has something in a wheel."""

    def _connection(self) -> BaseConnection:
        loop = ClosedLoop()
        loop.cart.base.inputs.set("jam_left", 1)
        loop.chain.ref_hard.configuration.set("gain_VP", "100")  # full torque, a stall
        return loop


def test_a_person_measures_where_a_real_cart_stands(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("10\n0\n" * 4))
    options = OnPort("tuned", "/dev/ttyUSB0", 115_200, None, None, False, BaseParameters())
    run_squares(options, SquarePlan(1, 0.3), None)
    told = capsys.readouterr().out
    assert told.count("Measured x of the cart from its start, mm") == 4
    assert "return, most    10.0    10.0 mm" in told


def test_a_square_that_does_not_end_is_told() -> None:
    options = Jammed("tuned", None, 115_200, None, None, False, BaseParameters())
    with pytest.raises(click.ClickException, match=r"fault of the base: stall \(left\)"):
        run_squares(options, SquarePlan(1, 0.3), None)


def test_a_goal_that_is_not_reached_is_told() -> None:
    connection = Jammed("tuned", None, 115_200, None, None, False, BaseParameters()).begin()
    with pytest.raises(click.ClickException, match=r"fault of the base: stall \(left\)"):
        require_arrival(connection, drive(connection, [Pose(1.0)]))
    connection = ClosedLoop()
    start(connection)
    with pytest.raises(click.ClickException, match=r"not there after 1\.0 s"):
        require_arrival(connection, drive(connection, [Pose(1.0)], timeout_us=1_000_000))


def test_odometry_conf_is_used(tmp_path: Path) -> None:
    conf = tmp_path / "Odometry.conf"
    conf.write_text("conf.default.radiusOfLeftWheel: 0.05\nconf.default.radiusOfRightWheel: 0.05")
    result = run("goto", "0.2", "0", "0", "--odometry-conf", conf)
    assert "at the end   2" in result.stdout  # it drives about twice as far


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["goto", "nan", "0", "0"], "nan 0 0 is no pose: metres, metres, radians"),
        (["goto", "1e9", "0", "0"], "1e+09 0 0 is beyond 1000 m"),
        (["goto", "-800", "800", "0"], "-800 800 0 is beyond 1000 m"),
        (["goto", "1", "0", "0", "--tread-m", "-1"], "--tread-m -1.0 is not above 0"),
        (["goto", "1", "0", "0", "--plot", "t.jpg"], "--plot t.jpg: the name ends in .png,"),
        (["goto", "1", "0", "0", "--plot", "/nowhere/t.svg"], "no directory /nowhere"),
        (["goto", "1", "0", "0", "--device", "x", "--pace", "1"], "--pace is for the emulated"),
        (["goto", "1", "0", "0", "--odometry-conf", "none"], "odometry-conf none: No such file"),
        (["path", "none.txt"], "path none.txt: No such file"),
    ],
)
def test_a_mistake_is_one_line(words: list[str], told: str) -> None:
    result = run(*words)
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_port_that_cannot_be_opened_is_one_line() -> None:
    result = run("goto", "1", "0", "0", "--device", "/dev/nothing")
    assert result.exit_code == 3
    assert result.stderr.startswith("Error: cannot open '/dev/nothing'")
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("1 2 3 4", ":1: '1 2 3 4' is not x y in metres"),
        ("1 2\n1 nan", ":2: '1 nan' is not x y in metres"),
        ("1 two", ":1: '1 two' is not x y in metres"),
        ("0, 0\n 1, x  # corner", ":2: '1, x' is not x y in metres"),
        ("0,1001", ":1: '0,1001' is beyond 1000 m"),
        ("0 1000\n0 1001", ":2: '0 1001' is beyond 1000 m"),
        ("# nothing", " has no point; a line has x and y in metres"),
    ],
)
def test_a_mistake_in_a_path_is_one_line(text: str, told: str, tmp_path: Path) -> None:
    file = tmp_path / "path.txt"
    file.write_text(text)
    result = run("path", file)
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_conf_that_cannot_be_is_one_line(tmp_path: Path) -> None:
    conf = tmp_path / "Odometry.conf"
    conf.write_text("conf.default.axle: 1")
    result = run("goto", "1", "0", "0", "--odometry-conf", conf)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "no parameter 'axle'" in result.stderr


PROGRAM = "from tickrig.emulators.rh3.{} import main; main()"


@pytest.fixture
def emulated(tmp_path: Path) -> Iterator[str]:
    """A base on a pty."""
    link = tmp_path / "rh3"
    words = ["-c", PROGRAM.format("cli"), "--link", str(link)]
    emulator = pexpect.spawn(sys.executable, words, env=environment(), timeout=30)
    emulator.expect("address 1")
    yield str(link)
    emulator.kill(signal.SIGINT)
    emulator.expect(pexpect.EOF)
    emulator.wait()


def environment() -> dict[str, str]:
    paths = os.pathsep.join(path for path in sys.path if path)
    return {**os.environ, "PYTHONPATH": paths}  # type: ignore[dict-item, unused-ignore]


@pytest.mark.realtime
def test_a_base_on_a_pty_is_driven_in_real_time(emulated: str) -> None:
    words = [sys.executable, "-c", PROGRAM.format("commands.motion_cli"), "goto", "0.1", "0", "0"]
    done = subprocess.run(
        [*words, "--device", emulated],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "limits       kept" in done.stdout


@pytest.mark.realtime
def test_virtual_time_can_be_held_back() -> None:
    began_s = time.monotonic()
    assert run("goto", "0.1", "0", "0", "--pace", "10").exit_code == 0
    assert time.monotonic() - began_s > 0.2


@pytest.mark.realtime
def test_ctrl_c_stops_the_base(emulated: str) -> None:
    program = PROGRAM.format("commands.motion_cli")
    words = ["-c", program, "goto", "9", "0", "0", "--device", emulated]
    rh3 = pexpect.spawn(sys.executable, words, env=environment(), timeout=30, encoding="utf-8")
    rh3.expect(r"\+0\.1\d m/s")  # the map has a line of numbers
    rh3.kill(signal.SIGINT)
    rh3.expect("stopped")
    rh3.expect(pexpect.EOF)
    rh3.close()
    assert rh3.exitstatus == 130


@pytest.mark.realtime
def test_ctrl_c_leaves_a_question() -> None:
    words = ["-c", PROGRAM.format("commands.motion_cli"), "square", "--device", "/dev/nothing"]
    rh3 = pexpect.spawn(sys.executable, words, env=environment(), timeout=30, encoding="utf-8")
    rh3.expect("press a key")
    rh3.kill(signal.SIGINT)
    rh3.expect("stopped")
    rh3.expect(pexpect.EOF)
    rh3.close()
    assert rh3.exitstatus == 130
