"""What tools/with-vcan says before it runs anything, and what COMMAND finds in its guest."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[1] / "tools" / "with-vcan"
guest = pytest.mark.usefixtures("user_mode_linux")


compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")


def run(*words: str, **environment: str) -> tuple[int, str, str]:
    done = subprocess.run(
        [str(TOOL), *words],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | environment,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def elsewhere(tmp_path: Path) -> dict[str, str]:
    """An environment in which nothing is remembered, and QEMU is not installed."""
    return {"XDG_CACHE_HOME": str(tmp_path / "cache"), "WITH_VCAN_QEMU": "no-qemu"}


def kernel(folder: Path, script: str) -> dict[str, str]:
    """Put a script in the place of the program of User-Mode Linux."""
    program = folder / "uml"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    return {"WITH_VCAN_UML": str(program)}


@pytest.fixture(scope="module")
def amx(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """User-Mode Linux as it is on a processor with AMX: ptrace has a larger state for it."""
    folder = tmp_path_factory.mktemp("amx")
    library = folder / "large.so"
    source = Path(__file__).with_name("large_xstate.c")
    subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", library, source], check=True)
    uml = shutil.which("linux.uml")
    return kernel(folder, f'LD_PRELOAD="$LD_PRELOAD {library}" exec {uml} "$@"')


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
        (["--way", "ulm"], "--way ulm: one of kernel uml uml-preload kvm qemu is wanted"),
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


@guest
@pytest.mark.realtime
def test_a_guest_that_dies_is_not_promised(tmp_path: Path, elsewhere: dict[str, str]) -> None:
    elsewhere |= kernel(tmp_path, "exit 1")
    status, out, err = run("--guest", "--where", **elsewhere)
    assert (status, out, err.count("\n")) == (125, "", 1)
    assert err.startswith("with-vcan: no way to SocketCAN: this kernel: left out by --guest; User-")
    assert "; User-Mode Linux: its guest does not run `true`; User-Mode Linux with a preload" in err
    assert "; QEMU without KVM, about 20 times slower: apt-get install qemu-system-x86" in err
    assert run("--guest", "true", **elsewhere) == (125, "", err)
    assert run("--way", "uml", "--where", **elsewhere)[::2] == (
        125,
        "with-vcan: User-Mode Linux: its guest does not run `true`, see with-vcan --way uml true\n",
    )


def test_what_is_missing_is_said_with_its_packages(elsewhere: dict[str, str]) -> None:
    elsewhere["WITH_VCAN_UML"] = "no-uml"
    status, out, err = run("--guest", "true", **elsewhere)
    assert (status, out, err.count("\n")) == (125, "", 1)
    assert "; User-Mode Linux: apt-get install user-mode-linux" in err


@guest
@pytest.mark.realtime
def test_ci_skips_its_interop_step_where_no_way_works(
    tmp_path: Path, elsewhere: dict[str, str]
) -> None:
    elsewhere |= kernel(tmp_path, "exit 1")
    (tmp_path / "apt-get").symlink_to("/bin/false")  # as without a package index
    elsewhere["PATH"] = f"{tmp_path}:{os.environ['PATH']}"
    words = [str(TOOL.parents[1] / ".ci" / "interop"), "--guest"]
    done = subprocess.run(
        words, capture_output=True, text=True, check=False, env=os.environ | elsewhere
    )
    assert (done.returncode, done.stdout) == (0, "skipped: no way to SocketCAN, see above\n")
    assert "User-Mode Linux: its guest does not run `true`" in done.stderr


@guest
@compiler
@pytest.mark.realtime
def test_a_guest_runs_where_the_processor_has_amx(
    amx: dict[str, str], elsewhere: dict[str, str]
) -> None:
    elsewhere |= amx
    status, out, err = run("--way", "uml", "true", **elsewhere)
    assert (status, out) == (125, "")
    assert "put_fp_registers" in err
    status, out, err = run("--guest", "cat", "/sys/class/net/vcan0/type", **elsewhere)
    assert (status, out) == (0, "280\n"), err
    assert err == "with-vcan: User-Mode Linux with a preload: vcan0 vcan1\n"
    folder = Path(elsewhere["XDG_CACHE_HOME"], "with-vcan")
    assert folder.stat().st_mode & 0o777 == 0o700
    (library,) = folder.glob("*.so")
    made = library.stat()
    assert run("--way", "uml-preload", "true", **elsewhere)[0] == 0
    assert library.stat() == made  # it is compiled once


@guest
@pytest.mark.realtime
def test_what_worked_is_remembered_until_a_program_changes(
    tmp_path: Path, elsewhere: dict[str, str]
) -> None:
    program = kernel(tmp_path, f'echo >>{tmp_path}/starts; exec {shutil.which("linux.uml")} "$@"')
    elsewhere |= program
    starts = tmp_path / "starts"
    status, worked, _ = run("--guest", "--where", **elsewhere)
    # On a processor with Intel AMX the kernel is tried twice, and works with the preload.
    assert status == 0
    assert re.fullmatch("User-Mode Linux( with a preload)?: vcan0 vcan1\n", worked)
    tried = starts.read_text()
    assert tried == ("\n\n" if "preload" in worked else "\n")
    assert run("--guest", "--where", **elsewhere)[:2] == (0, worked)
    assert starts.read_text() == tried
    kernel(tmp_path, "exit 1")
    assert run("--guest", "--where", **elsewhere)[0] == 125


@guest
@pytest.mark.realtime
def test_a_folder_that_others_can_write_to_is_not_trusted(elsewhere: dict[str, str]) -> None:
    folder = Path(elsewhere["XDG_CACHE_HOME"], "with-vcan")
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    assert run("--way", "uml-preload", "true", **elsewhere)[0] == 0
    assert run("--guest", "--where", **elsewhere)[0] == 0
    assert [*folder.iterdir()] == []


@guest
@pytest.mark.realtime
def test_a_guest_that_is_only_tried_ends_with_it(tmp_path: Path, elsewhere: dict[str, str]) -> None:
    fifo = tmp_path / "alive"
    os.mkfifo(fifo)
    elsewhere |= kernel(tmp_path, f"exec >{fifo}; echo; exec sleep 1000")
    words = [str(TOOL), "--guest", "--where"]
    with subprocess.Popen(words, env=os.environ | elsewhere, stderr=subprocess.DEVNULL) as process:
        with fifo.open() as alive:
            assert alive.readline() == "\n"
            process.send_signal(signal.SIGTERM)
            assert alive.read() == ""  # nobody has it open any more
        assert process.wait() == 143


@guest
@pytest.mark.realtime
@pytest.mark.timeout(600)
def test_a_guest_that_never_begins_is_given_up(tmp_path: Path, elsewhere: dict[str, str]) -> None:
    elsewhere |= kernel(tmp_path, "echo it stands still; exec sleep 1000")
    status, out, err = run("--way", "uml", "true", **elsewhere)
    assert (status, out) == (125, "")
    assert re.search(
        r"^it stands still\nwith-vcan: the guest did not begin within \d+ s; above is the end of"
        r" what its kernel said\n\Z",
        err,
        re.MULTILINE,
    )


INTERRUPTED = """
import math, signal

signal.signal(signal.SIGALRM, lambda *_: math.sqrt(2) ** 0.5)

def computed():
    return sum(math.sin(number) * 1.0001 ** (number % 7) for number in range(300_000))

signal.setitimer(signal.ITIMER_REAL, 0)
before = computed()
signal.setitimer(signal.ITIMER_REAL, 0.002, 0.002)
print(before == computed() == computed())
"""


@guest
@compiler
@pytest.mark.realtime
@pytest.mark.parametrize("large", [False, True], ids=["as it is", "amx"])
def test_numbers_survive_signals_and_other_processes_under_the_preload(
    large: bool, amx: dict[str, str]
) -> None:
    both = f"{sys.executable} -c '{INTERRUPTED}' & {sys.executable} -c '{INTERRUPTED}'; wait"
    status, out, err = run("--way", "uml-preload", "sh", "-c", both, **(amx if large else {}))
    assert (status, out.split()) == (0, ["True", "True"]), err


COUNTED = hashlib.md5("".join(f"{number}\n" for number in range(1, 50_001)).encode()).hexdigest()


@pytest.mark.realtime
@pytest.mark.timeout(600)
@pytest.mark.skipif(shutil.which("qemu-system-x86_64") is None, reason="no QEMU here")
def test_qemu_without_kvm_runs_a_command() -> None:
    told = (
        "echo $WITH_VCAN_SLOWDOWN $TMPDIR; cat /sys/class/net/vcan?/type;"
        " seq 50000 | md5sum >&2; exit 3"
    )
    status, out, err = run("--way", "qemu", "bash", "-c", told)
    assert (status, out.split()) == (3, ["20", "/dev/shm", "280", "280"]), err
    assert err.split()[-2] == COUNTED


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
