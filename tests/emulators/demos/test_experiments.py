"""`tickrig demo follow`, `leader`, `four`, `joystick`: robots re-connected while they run."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.name_server import eventually
from tickrig.emulators.commands.cli import main
from tickrig.emulators.demos import experiments
from tickrig.emulators.demos.experiments import ConvoyRun, Experiment
from tickrig.emulators.demos.tracks import RobotSample, RobotTrack, draw

DEADLINE_S = 60.0
LIVE = ("follow", "leader", "four", "joystick")
ALL = (*LIVE, "rh3", "beego", "fourx")
REF_HARD, SEGWAY, BLACKSHIP, OMNI = range(4)


@cache
def played(experiment: str) -> ConvoyRun:
    """Run an experiment once for all tests that ask."""
    table: Experiment = getattr(experiments, experiment)
    run = ConvoyRun(table, lambda line: None)
    run.play()
    return run


def between(track: RobotTrack, from_s: float, to_s: float) -> list[RobotSample]:
    return [look for look in track.looks if from_s <= look.time_s <= to_s]


def speeds(track: RobotTrack, from_s: float, to_s: float) -> list[tuple[float, float]]:
    return [(v, w) for at_s, v, w in track.speeds() if from_s < at_s <= to_s]


def test_each_robot_keeps_its_distance_to_the_one_before_it() -> None:
    _, segway, omni = played("FOLLOW").tracks
    for track in (segway, omni):
        gaps_m = [look.gap_m for look in between(track, 10, 44)]
        assert all(gap_m is not None and 0.95 < gap_m < 1.15 for gap_m in gaps_m)


def test_the_planned_path_is_that_of_the_leader_and_changes_with_it() -> None:
    tracks = played("LEADER").tracks
    for from_s, to_s, leader in ((0.1, 12, OMNI), (12.3, 26, SEGWAY), (26.3, 38, OMNI)):
        ways = zip(*(between(tracks[n], from_s, to_s) for n in (REF_HARD, leader)), strict=True)
        assert all(own.planned == led.pose for own, led in ways)
    assert [mark.time_s for mark in played("LEADER").marks] == [12, 26, 38, 44]


def test_a_follower_whose_leader_is_removed_waits_and_follows_again_when_it_is_joined() -> None:
    ref_hard = played("LEADER").tracks[REF_HARD]
    assert {look.planned for look in between(ref_hard, 38.1, 44)} == {None}
    assert all(abs(v) < 0.001 for v, _ in speeds(ref_hard, 43, 44))
    assert between(ref_hard, 57, 58)[0].gap_m == pytest.approx(1.08, abs=0.05)


def test_one_joystick_drives_four_robots_that_had_stopped_without_a_command() -> None:
    tracks = played("FOUR").tracks
    for track in tracks:
        assert all(abs(v) < 0.01 for v, _ in speeds(track, 12.5, 13))
        assert all(v == pytest.approx(0.3, abs=0.01) for v, _ in speeds(track, 15, 34))
    turns = [[w for _, w in speeds(track, 35, 36)] for track in tracks]
    assert min(turns[SEGWAY] + turns[OMNI]) > 0.25
    assert max(turns[REF_HARD] + turns[BLACKSHIP]) < -0.25


def test_robots_of_different_make_drive_alike_on_one_joystick_of_phase_1() -> None:
    ref_hard, omni = (speeds(track, 1, 28) for track in played("JOYSTICK").tracks)
    for one, other in zip(ref_hard, omni, strict=True):
        assert one == pytest.approx(other, abs=0.16)  # they accelerate differently
    turns = [w for _, w in omni]
    assert (max(turns), min(turns)) == pytest.approx((0.3, -0.3), abs=0.01)
    joystick = played("JOYSTICK").convoy.loop.manager.port("JoystickA.out")
    assert joystick.profile.properties["dataport.data_type"] == "IDL:RTC/TimedVelocity:1.0"


def test_a_robot_stops_whose_joystick_is_taken_away_while_it_is_pushed() -> None:
    run = ConvoyRun(experiments.JOYSTICK, lambda line: None)
    loop = run.convoy.loop
    loop.run_to(3_000_000)
    loop.manager.disconnect("JoystickA.out", "MovingControl0.in")
    loop.run_to(5_000_000)
    there = run.convoy.robots[0].true_pose
    loop.run_to(6_000_000)
    assert run.convoy.robots[0].true_pose.distance(there) < 1e-6
    assert there.x > 0.8


@pytest.mark.parametrize("name", ["joystick", "beego"])
def test_the_lines_are_the_same_with_any_hash_seed(name: str) -> None:
    outputs = {
        subprocess.run(
            [sys.executable, "-m", "tickrig", "demo", name],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("0", "1")
    }
    assert len(outputs) == 1


@pytest.mark.parametrize("experiment", ["FOLLOW", "LEADER", "FOUR", "JOYSTICK"])
def test_the_picture_has_names_units_and_the_acts(experiment: str) -> None:
    run, table = played(experiment), getattr(experiments, experiment)
    figure = draw(run.tracks, run.marks, table.title)
    ground, *curves = figure.axes
    legend = ground.get_legend()
    assert legend is not None
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == [*table.names, "planned", "driven", "start", "end"]
    assert (ground.get_xlabel(), ground.get_ylabel()) == ("x, m", "y, m")
    units = [axes.get_ylabel() for axes in curves]
    assert units[:2] == ["speed, m/s", "turning, rad/s"]
    assert curves[-1].get_xlabel() == "time, s"
    assert figure.get_supxlabel().count("\n") == max(0, len(run.marks) - 1)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--plot", "a.doc"), "--plot a.doc: the name ends in .png, .svg, .html"),
        (("--plot", "none/a.png"), "--plot none/a.png: no directory none"),
    ],
)
def test_a_picture_that_cannot_be_written_is_refused_before_the_run(
    name: str, words: tuple[str, ...], reason: str
) -> None:
    result = CliRunner().invoke(main, ["demo", name, *words])
    assert (result.exit_code, result.output) == (2, f"Error: {reason}\n")


@pytest.mark.parametrize("name", LIVE)
@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--control", "none/ctl"), "control none/ctl: No such file or directory"),
        (("--openrtm-names", "%n.rtc"), "--openrtm-names is for --openrtm"),
    ],
)
def test_what_cannot_be_served_is_refused_in_a_line(
    name: str, words: tuple[str, ...], reason: str
) -> None:
    result = CliRunner().invoke(main, ["demo", name, *words])
    assert (result.exit_code, result.output.splitlines()[-1]) == (2, f"Error: {reason}")


# In real time, with tools in other processes.


@contextmanager
def live(folder: Path, name: str, *words: str) -> Iterator[subprocess.Popen[str]]:
    """Run a demonstration that `tickrig rtc --at FOLDER/ctl` reaches."""
    command = [sys.executable, "-u", "-m", "tickrig", "demo", name]
    with subprocess.Popen(
        [*command, "--control", str(folder / "ctl"), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stderr is not None
            assert process.stderr.readline().endswith("Ctrl-C ends.\n")
            yield process
        finally:
            process.kill()


def rtc(folder: Path, *words: str) -> str:
    """Run a verb of `tickrig rtc` in a process of its own."""
    command = [sys.executable, "-m", "tickrig", "rtc", *words, "--at", str(folder / "ctl")]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def place(folder: Path, port: str = "Odometry0.OdometryPosition") -> tuple[float, float]:
    """Return the position that a robot writes next."""
    printed = json.loads(rtc(folder, "print", port, "-n", "1", "--json"))
    position = printed["data"]["position"]
    return position["x"], position["y"]


def stands(folder: Path) -> Callable[[], bool]:
    def compare() -> bool:
        before, now = place(folder), place(folder)
        return max(abs(a - b) for a, b in zip(before, now, strict=True)) < 1e-3

    return compare


@pytest.mark.realtime
@pytest.mark.timeout(240)
def test_tickrig_rtc_removes_and_joins_connections_of_a_running_convoy(tmp_path: Path) -> None:
    picture = tmp_path / "leader.png"
    with live(tmp_path, "leader", "--plot", str(picture)) as process:
        old, new = ("OmniCart0.OdometryPosition", "Odometry1.OdometryPosition")
        rtc(tmp_path, "dis", old, "Follower0.leader")
        eventually(stands(tmp_path), "Ref-Hard drives on without a leader")
        rtc(tmp_path, "con", new, "Follower0.leader")
        eventually(lambda: not stands(tmp_path)(), "Ref-Hard does not follow its new leader")
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 0
    assert f"  dis {old} Follower0.leader\n" in output
    assert f"  con {new} Follower0.leader\n" in output
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.realtime
@pytest.mark.timeout(240)
@OMNIORB
def test_rtshell_removes_and_joins_connections_of_a_running_convoy(tmp_path: Path) -> None:
    from tests.host.rtc.engines.openrtm.live_system import has_components, live_system  # noqa: PLC0415 - an extra

    with live_system(tmp_path, command="tickrig demo leader") as system:
        has_components(system, "Follower0", "Odometry1", "OmniCart0")
        follower = "@/Follower0.rtc:leader"
        old, new = ("@/OmniCart0.rtc:OdometryPosition", "@/Odometry1.rtc:OdometryPosition")
        assert system.tool("rtdis", old, follower) == (0, "", "")
        eventually(stands(tmp_path), "Ref-Hard drives on without a leader")
        assert system.tool("rtcon", new, follower) == (0, "", "")
        eventually(lambda: not stands(tmp_path)(), "Ref-Hard does not follow its new leader")
        code, said = system.end(signal.SIGINT)
    assert (code, "Traceback" in said) == (0, False)


@pytest.mark.realtime
@pytest.mark.parametrize("name", ["follow", "rh3", "fourx"])
def test_ctrl_c_ends_a_demonstration_in_virtual_time(name: str) -> None:
    command = [sys.executable, "-u", "-m", "tickrig", "demo", name]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline()
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=DEADLINE_S)
    assert (process.returncode, "Traceback" in said) == (130, False)
