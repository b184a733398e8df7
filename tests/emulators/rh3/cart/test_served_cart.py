"""`rh3 serve`: commands that are typed, and those over its control socket."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pexpect
import pytest
from click.testing import CliRunner

from tickrig.emulators.commands.cli import main
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.emulators.rh3.commands.motion_cli import main as rh3
from tickrig.emulators.rh3.commands.served_cart import CartClock, CartControl, ServedCart
from tickrig.host.control.client import ControlClient
from tickrig.host.rtc.motion.drive import start
from tickrig.host.rtc.motion.geometry import Pose

ASKS = "PositionInput0 goal X Y DEG; path FILE; path X Y, X Y DEG; path; end"
RH3 = [sys.executable, "-c", "from tickrig.commands import rh3; rh3()"]
NAMES = "RefHardRh30, Odometry0, PositionInput0, OmniTo2WD0, Navigation0, PathFollower0"


class Controlled:
    """A cart in virtual time, and its control."""

    def __init__(self) -> None:
        self.loop = ClosedLoop()
        start(self.loop)
        self.control = CartControl(self.loop, ServedCart(self.loop, CartClock()))

    def ask(self, do: str, **fields: object) -> dict[str, object]:
        return self.control.answer({"v": 1, "do": do, **fields})

    def arrived(self) -> bool:
        return self.loop.run_until(lambda: self.ask("status")["idle"] is True, 120_000_000)


def test_a_goal_and_a_path_are_asked_for_and_finish() -> None:
    cart = Controlled()
    assert cart.ask("goal", pose=[0.3, 0, 90])["ok"]
    assert cart.ask("path", points=[[0.3, 0.3], [0, 0.3, 180]])["ok"]
    assert cart.arrived()
    status = cart.ask("status")
    assert (status["finished"], status["components"]) == (2, 6)
    assert cart.loop.chain.odometry.pose.distance(Pose(0.0, 0.3)) < 0.05
    assert abs(abs(float(str(status["heading_deg"]))) - 180) < 2


def test_a_path_without_points_is_the_defined_one() -> None:
    cart = Controlled()
    cart.loop.chain.position_input.defined_path = (Pose(0.2), Pose(0.2, 0.2))
    assert cart.ask("path")["ok"]
    assert cart.arrived()
    assert cart.loop.chain.odometry.pose.distance(Pose(0.2, 0.2)) < 0.05


def test_after_the_end_it_is_in_error_and_takes_no_command_until_it_is_reset() -> None:
    cart = Controlled()
    assert cart.ask("end")["ok"]
    assert "PositionInput0 has ended" in str(cart.ask("goal", pose=[1, 0, 0])["error"])
    cart.loop.run_to(cart.loop.now_us + 100_000)
    assert cart.loop.manager.state_of("PositionInput0").name == "ERROR"
    assert cart.ask("reset", name="PositionInput0")["ok"]
    cart.loop.run_to(cart.loop.now_us + 100_000)
    assert cart.ask("activate", name="PositionInput0")["ok"]
    assert cart.ask("goal", pose=[0.1, 0, 0])["ok"]
    assert cart.arrived()


@pytest.mark.parametrize(
    ("do", "fields", "error"),
    [
        ("goal", {}, "a pose is [x, y, deg] in metres and degrees, not null"),
        ("goal", {"pose": [1, 2]}, "a pose is [x, y, deg] in metres and degrees, not [1, 2]"),
        ("goal", {"pose": [1, True, 2]}, "a pose is [x, y, deg] in metres and degrees"),
        ("goal", {"pose": [1, 2, 3, 4]}, "'[1, 2, 3, 4]' is not X Y in metres"),
        ("goal", {"pose": [1e30, 2, 3]}, "'[1e+30, 2, 3]' is not X Y in metres"),
        ("goal", {"pose": [2000, 0, 0]}, "'[2000, 0, 0]' is beyond 1000 m"),
        ("path", {"points": 5}, "points is a list of [x, y] or [x, y, deg], not 5"),
        ("path", {"points": [[1, 2]]}, "a path has 2 points or more, got 1"),
        ("path", {"points": [[1, 2], 3]}, "a pose is [x, y, deg] in metres and degrees, not 3"),
        ("end", {"now": 1}, 'end has no field "now"; fields: none'),
        ("create", {"type": "ConsoleIn"}, 'no request "create"'),
    ],
)
def test_a_request_that_cannot_be_is_refused(
    do: str, fields: dict[str, object], error: str
) -> None:
    cart = Controlled()
    assert error in str(cart.ask(do, **fields)["error"])
    assert cart.loop.chain.position_input.idle


@pytest.mark.realtime
def test_tickrig_ctl_and_tickrig_rtc_work_with_a_served_cart(tmp_path: Path) -> None:
    file = tmp_path / "corners.txt"
    file.write_text("0.2 0\n0.2 0.2 0\n")
    control = tmp_path / "control"
    process = subprocess.Popen(
        [*RH3, "serve", "--control", str(control), "--pace", "100"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    )

    def tickrig(*words: str | Path) -> str:
        result = CliRunner().invoke(main, [str(word) for word in words])
        assert result.exit_code == 0, result.output
        return result.output

    try:
        while not control.exists():
            assert process.poll() is None
        tickrig("ctl", control, "goal", "-0.2", "0", "-90")
        tickrig("ctl", control, "path", file)
        tickrig("ctl", control, "end")
        listed = tickrig("rtc", "ls", "-l", "--at", control)
        names = [line.split()[-1] for line in listed.splitlines()]
        assert names == NAMES.split(", ")
        while "finished 2\n" not in tickrig("ctl", control, "status"):
            assert process.poll() is None
        tickrig("ctl", control, "stop")
        said, _ = process.communicate(timeout=60)
    finally:
        process.kill()
    assert said.splitlines()[:-1] == [
        "PositionInput0 goal -0.200 0.000 m, -90.0 deg",
        "PositionInput0 FINISH",
        "PositionInput0 path of 2 points to 0.200 0.200 m, 0.0 deg",
        "PositionInput0 FINISH",
        "PositionInput0 the end",
    ]


@pytest.mark.realtime
def test_commands_are_piped_in_and_the_run_ends_after_the_last() -> None:
    done = subprocess.run(
        [*RH3, "serve", "--pace", "1000"],
        input="goal 0.2 0 0\nstop\ngoal 0.4 0 0",
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    *told, last = done.stdout.splitlines()
    assert told == [
        "PositionInput0 goal 0.200 0.000 m, 0.0 deg",
        "PositionInput0 FINISH",
        "PositionInput0 goal 0.400 0.000 m, 0.0 deg",
        "PositionInput0 FINISH",
    ]
    assert last.startswith("ran ")
    assert done.stderr.splitlines()[0] == f"{NAMES}. Ctrl-C ends."
    assert "'stop' is not a command: goal X Y DEG" in done.stderr


@pytest.mark.realtime
def test_at_a_terminal_it_asks_drives_and_asks_again() -> None:
    terminal = pexpect.spawn(RH3[0], [*RH3[1:], "serve", "--pace", "1000"], timeout=60, echo=False)
    terminal.expect_exact(ASKS)
    terminal.sendline("goal 0.2 0 0")
    terminal.expect_exact("FINISH")
    terminal.expect_exact(ASKS)
    terminal.sendline("end")
    terminal.expect_exact("PositionInput0 the end")
    terminal.sendintr()
    terminal.expect_exact("ran ")
    terminal.expect(pexpect.EOF)


@pytest.mark.realtime
def test_in_the_background_of_a_terminal_it_leaves_what_is_typed_to_the_shell(
    tmp_path: Path,
) -> None:
    control = tmp_path / "cart"
    command = shlex.join([*RH3, "serve", "--pace", "50", "--control", str(control)])
    shell = pexpect.spawn("bash", ["--norc", "-i"], timeout=60, echo=False)
    shell.sendline(f"{command} &")
    shell.expect_exact("Ctrl-C ends")
    shell.sendline("echo he''re")
    shell.expect_exact("here")
    with ControlClient(control) as cart:  # a process that the terminal had stopped would be silent
        cart.request("goal", pose=[0.1, 0, 0])
        shell.expect_exact("FINISH")
        cart.request("stop")
    shell.expect_exact("ran ")
    shell.close(force=True)


def test_with_nobody_to_command_it_the_run_ends_at_once() -> None:
    result = CliRunner().invoke(rh3, ["serve", "--pace", "1000"])
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("ran 0.5")
