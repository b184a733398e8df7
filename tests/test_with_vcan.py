"""What tools/with-vcan says before it runs anything, and what COMMAND finds in its guest."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[1] / "tools" / "with-vcan"
guest = pytest.mark.skipif(
    not all(map(shutil.which, ("linux.uml", "modprobe", "ip"))),
    reason="no guest here: it wants the packages user-mode-linux, kmod and iproute2",
)


def run(*words: str) -> tuple[int, str, str]:
    done = subprocess.run([str(TOOL), *words], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def test_its_help_has_examples() -> None:
    status, out, _ = run("--help")
    assert status == 0
    assert "  with-vcan pytest tests/interop\n" in out


def test_the_page_has_the_options_of_the_help_with_what_holds_unless_given() -> None:
    page = (TOOL.parents[1] / "docs" / "howto" / "ci.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `(--.+?)` \| (.+) \|$", page, re.MULTILINE))
    _, out, _ = run("--help")
    told = dict(re.findall(r"^  (--\S+(?: \S+)?)  +(.+(?:\n {10,}.+)*)$", out, re.MULTILINE))
    assert [*rows] == [*told]
    assert {option: given(text) for option, text in rows.items()} == {
        option: given(text) for option, text in told.items()
    }


def given(text: str) -> str:
    """Return what stands in brackets: what holds where an option is not given."""
    return "".join(re.findall(r"\(([^)]+)\)", text)).replace("`", "")


@guest
def test_the_commands_of_the_page_say_where_they_would_run() -> None:
    page = (TOOL.parents[1] / "docs" / "howto" / "ci.md").read_text("utf-8")
    commands = re.findall(r"^with-vcan (.*?)pytest  ", page, re.MULTILINE)
    assert len(commands) == 4
    for options in commands:
        names = re.findall(r"can\d", options) or ["vcan0", "vcan1"]
        status, out, err = run(*options.split(), "--where")
        assert (status, err) == (0, "")
        assert re.findall(r"\bv?can\d", out) == names


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ([], "no command; see with-vcan --help"),
        (["--fast", "true"], "no option --fast; see with-vcan --help"),
        (["--timeout"], "--timeout needs a value"),
        (["--timeout", "1m", "true"], "--timeout 1m: whole seconds are wanted, as 60"),
        (["--memory", "lots", "true"], "--memory lots: a size is wanted, as 512M or 1G"),
        (["--bus", "9", "true"], "--bus 9: a name is wanted, as vcan0"),
        (["--bus", "a,b", "true"], "--bus a,b: a name is wanted, as vcan0"),
        (["--bus", "can0;reboot", "true"], "--bus can0;reboot: a name is wanted, as vcan0"),
        (["--vxcan", "can0", "true"], "--vxcan can0: two names are wanted, as can0,can1"),
        (["--vxcan", "a,b,c", "true"], "--vxcan a,b,c: two names are wanted, as can0,can1"),
        (["--bus", "a", "--vxcan", "b,a", "true"], "a: named twice"),
        (["--fd", "--classic", "true"], "one of --fd and --classic is wanted, once"),
    ],
)
def test_a_mistake_is_one_line_and_status_125(words: list[str], error: str) -> None:
    assert run(*words) == (125, "", f"with-vcan: {error}\n")


CABLE = """
import can

with (
    can.Bus("can_left", interface="socketcan", fd=True) as left,
    can.Bus("can_right", interface="socketcan", fd=True) as right,
    can.Bus("can-else", interface="socketcan") as elsewhere,
):
    for sender, receiver, data, is_fd in (
        (left, right, b"classic", False),
        (right, left, b"classic", False),
        (left, right, bytes(64), True),
    ):
        try:
            sender.send(can.Message(0, 5, is_fd=is_fd, data=data))
        except can.CanError:
            print("refused")
            continue
        print(len(receiver.recv(10).data), sender.recv(0), elsewhere.recv(0))
"""
BUSES = ("--vxcan", "can_left,can_right", "--bus", "can-else", "--timeout", "60")


@guest
@pytest.mark.realtime
@pytest.mark.parametrize(("option", "long"), [("--fd", "64 None None"), ("--classic", "refused")])
def test_a_vxcan_is_a_cable_between_two_adapters(option: str, long: str) -> None:
    status, out, err = run("--guest", option, *BUSES, sys.executable, "-c", CABLE)
    assert (status, out.splitlines()) == (0, ["7 None None", "7 None None", long]), err


MULTICAST = """
import can

for group in ("ff15:7079:7468:6f6e:6465:6d6f:6d63:6173", "239.74.163.2"):
    with can.Bus(group, interface="udp_multicast") as bus:
        bus.send(can.Message(arbitration_id=0x123))
        print(bus.recv(10).arbitration_id)
"""


@guest
@pytest.mark.realtime
def test_the_multicast_bus_of_python_can_works_in_the_guest() -> None:
    status, out, err = run("--guest", "--multicast", sys.executable, "-c", MULTICAST)
    assert (status, out.split()) == (0, ["291", "291"]), err


@guest
@pytest.mark.realtime
@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--bus", "lo", "--bus", "can7"], "with-vcan: the guest cannot make lo \n"),
        (["--memory", "1M"], "with-vcan: the guest did not finish; above is the end of what"),
    ],
)
def test_a_guest_that_cannot_be_made_so_says_it_at_once(words: list[str], error: str) -> None:
    status, out, err = run("--guest", "--timeout", "600", *words, "true")
    assert (status, out) == (125, "")
    assert error in err


@guest
@pytest.mark.realtime
def test_nothing_is_left_when_a_pipeline_is_ended() -> None:
    """Its standard error is shut by then, as that of `with-vcan ... 2>&1 | tail`."""
    told = ["sh", "-c", "echo $MODPROBE_OPTIONS; exec sleep 1000"]
    with subprocess.Popen(
        [str(TOOL), "--guest", *told],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        folder = Path(process.stdout.readline().split()[1])
        assert folder.is_dir()
        process.stderr.close()
        os.killpg(process.pid, signal.SIGTERM)
        process.wait()
    assert not folder.exists()
