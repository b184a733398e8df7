from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.emulators.testing.report.html_tree import parse_page
from tickrig.emulators.testing.commands.replay_cli import replay_command
from tickrig.emulators.testing.commands.run_cli import run
from tickrig.host.control.client import ControlClient
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rrc import RrcClient
from tickrig.wire.rrc.replies import RrcEvent

RIG = """\
[device.vr2]
type = "rrc"

[device.lidar]
type = "urg"
config.room = "4,3"

[device.left]
type = "epos"
node_id = 1
[device.left.start]
load_nm = { ramp = [0, 1], over = "1s" }

[fault]
vr2 = "cut@1s-2s"
left = "shaft_blocked@1.5s"
"""
GROUP = "239.74.163.27"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(RIG)
    return tmp_path


def tickrig_run(*words: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(run, words)
    return result.exit_code, result.stdout, result.stderr


INERT = """\
[1000]
ParameterName=Device type
DataType=7
AccessType=ro
[6040]
ParameterName=Controlword
DataType=6
AccessType=rww
[6041]
ParameterName=Statusword
DataType=6
AccessType=ro
[6060]
ParameterName=Modes of operation
DataType=2
AccessType=rw
"""


def test_what_an_eds_leaves_open_is_told(folder: Path) -> None:
    (folder / "drive.eds").write_text(INERT)
    rig = '[device.left]\ntype = "drive.eds"\nnode_id = 1\n'
    (folder / "rig.toml").write_text(rig)
    status, _, err = tickrig_run("rig.toml", "--virtual", "--for", "1s")
    hint = '1000h has no value: no profile; use --profile 402 (in a rig file: profile = "402")'
    assert (status, err.splitlines()[:-1]) == (0, [f"left: drive.eds: {hint}"])
    (folder / "rig.toml").write_text(f'{rig}profile = "402"\n')
    assert "no profile" not in tickrig_run("rig.toml", "--virtual", "--for", "1s")[2]


@pytest.mark.usefixtures("folder")
def test_in_virtual_time_it_runs_as_fast_as_it_goes_and_shows_events() -> None:
    status, out, err = tickrig_run("rig.toml", "--virtual", "--for", "3s", "-v")
    assert (status, err) == (0, "ran 3.000 s; vr2 lost: 0; lidar lost: 0; can lost: 0\n")
    assert out.splitlines() == [
        "0.001000 * vr2/state Off",
        "0.001000 * left/state Pre-operational",
        "0.010000 * vr2/state WaitPowerOn",
        "1.000000 vr2 ! cut",
        "1.500000 left ! shaft_blocked=1",
        "2.000000 vr2 ! cut=0",
    ]


@pytest.mark.usefixtures("folder")
def test_what_passes_is_shown_if_that_is_wanted() -> None:
    _, out, _ = tickrig_run("rig.toml", "--virtual", "--for", "20ms", "-vv")
    assert "can < 701#00" in out
    assert "vr2 < EV:Initialized" in out


@pytest.mark.usefixtures("folder")
def test_a_trace_is_replayed(folder: Path) -> None:
    words = ("rig.toml", "--virtual", "--for", "2s", "--trace")
    assert tickrig_run(*words, "a.trace", "--fault", "lidar/motor_jammed@1s")[0] == 0
    result = CliRunner().invoke(replay_command, ["a.trace"])
    assert (result.exit_code, result.stdout.startswith("identical")) == (0, True)
    tickrig_run(*words, "b.trace", "--fault", "lidar/motor_jammed@1s")
    assert (folder / "a.trace").read_bytes() == (folder / "b.trace").read_bytes()


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["rig.toml", "--virtual"], "Error: --virtual wants a time: --for 10s"),
        (["rig.toml", "--virtual", "--for", "1s", "--control", "x"], "--control belongs to real"),
        (["rig.toml", "--for", "x"], "--for 'x' is not a time"),
        (["nowhere.toml"], "Error: file nowhere.toml: No such file or directory"),
        (["wrong.toml"], "wrong.toml:2: device.a.type: no device 'rcr'; did you mean 'rrc'?"),
        (["rig.toml", "--fault", "xyz"], "--fault: no fault 'xyz'"),
        (["rig.toml", "--virtual", "--for", "1s", "--trace", "no/t"], "trace no/t: No such file"),
        (["link.toml"], "Error: link no/pty: No such file or directory"),
        (["bus.toml"], "Error: "),
    ],
)
def test_what_cannot_be_is_told(folder: Path, words: list[str], complaint: str) -> None:
    rrc = '[device.a]\ntype = "rrc"\n'
    (folder / "wrong.toml").write_text(rrc.replace("rrc", "rcr"))
    (folder / "link.toml").write_text(rrc + '[real.a]\nlink = "no/pty"\n')
    node = '[device.a]\ntype = "epos"\n[real.can]\ninterface = "nonesuch"\n'
    (folder / "bus.toml").write_text(node)
    status, out, err = tickrig_run(*words)
    assert (status, out, "Traceback" in err) == (2, "", False)
    assert complaint in err
    assert err.count("\n") == 1 or "Usage" in err


def test_a_mistake_of_a_user_s_class_is_one_line(folder: Path) -> None:
    (folder / "mine.py").write_text(
        "from tickrig.device.canopen.device_rtc import CanopenComponent\n"
        "class Mine(CanopenComponent):\n"
        "    type_name = 'Mine'\n"
        "    def on_initialize(self):\n"
        "        raise KeyError('oops')\n"
    )
    (folder / "own.toml").write_text('[device.a]\ntype = "mine.py:Mine"\nnode_id = 5\n')
    status, _, err = tickrig_run("own.toml", "--virtual", "--for", "1s")
    assert (status, "Traceback" in err) == (2, False)


MOVING = """\
[device.left]
type = "epos"
node_id = 1
[device.right]
type = "epos"
node_id = 2
[device.left.start]
load_nm = { ramp = [0, 1], over = "1s" }
[signal]
half = { formula = "0.5 * t" }
[body]
kind = "differential"
left = "left"
right = "right"
wheel_radius_m = 0.078
tread_m = 0.33
mass_kg = 8.0
"""
VIRTUAL = ("moving.toml", "--virtual", "--for", "2s")


@pytest.fixture
def moving(folder: Path) -> Path:
    (folder / "moving.toml").write_text(MOVING)
    return folder


@pytest.mark.usefixtures("moving")
def test_curves_are_drawn_in_the_terminal() -> None:
    status, out, err = tickrig_run(*VIRTUAL, "--plot", "left.shaft_deg, half", "--plot", "x_m:y_m")
    assert (status, err) == (0, "ran 2.000 s; can lost: 0\n")
    curves, path = out.split("\n\n", 1)
    assert [line[:16] for line in curves.splitlines()[:2]] == [
        "━ left/shaft_deg",
        "━ half 1  (axis ",
    ]
    assert curves.splitlines()[-1].rstrip().endswith(" s")
    assert path.startswith("body/y_m -0")
    assert any("\u2800" < letter < "\u28ff" for letter in path)


def test_curves_are_written_whole_as_the_name_says(moving: Path) -> None:
    pytest.importorskip("matplotlib")
    words = (*VIRTUAL, "--plot", "left/shaft_deg,half", "--plot", "x_m:y_m")
    files = ("a.png", "a.svg", "a.html", "a.csv")
    assert tickrig_run(*words, *(word for file in files for word in ("-o", file)))[:2] == (0, "")
    assert (moving / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (moving / "a.svg").read_text()
    assert (moving / "a.html").read_text().startswith("<!DOCTYPE html>")
    head, *rows = (moving / "a.csv").read_text().splitlines()
    assert head == "t_s,left/shaft_deg [deg],half,body/x_m [m],body/y_m [m]"
    assert rows[-1].startswith("2.000000,")
    before = (moving / "a.csv").read_bytes()
    tickrig_run(*words, "-o", "a.csv")
    assert (moving / "a.csv").read_bytes() == before


def test_a_signal_without_a_number_has_an_empty_curve(moving: Path) -> None:
    pytest.importorskip("matplotlib")
    (moving / "moving.toml").write_text(MOVING.replace("0.5 * t", "0 / 0 * t"))
    words = (*VIRTUAL, "--plot", "half", "--plot", "half:half")
    assert "half:half: no samples" in tickrig_run(*words)[1]
    files = ("-o", "a.png", "-o", "a.csv", "--report", "run.html")
    assert tickrig_run(*words, *files)[0] == 0
    assert (moving / "a.csv").read_text() == "t_s,half\n"


def test_an_object_of_a_node_is_a_curve_though_its_name_has_a_colon(moving: Path) -> None:
    words = ("--plot", "left/0x1003:0", "--plot", "left/0x1003:0:right/0x1003:0", "-o", "a.csv")
    assert tickrig_run(*VIRTUAL, *words)[0] == 0
    head = (moving / "a.csv").read_text().splitlines()[0]
    assert head.split(",")[1:] == ["left/0x1003:0 [UNSIGNED8]", "right/0x1003:0 [UNSIGNED8]"]


@pytest.mark.usefixtures("moving")
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("--plot left/shaft_dg", "no signal 'left/shaft_dg'; did you mean 'left/shaft_deg'?"),
        ("--plot x_m:y_n", "no signal 'y_n'; did you mean"),
        ("--plot x_m,", "no signal ''"),
        ("--plot half,x_m:y_m", "a path stands alone: --plot x_m:y_m --plot SIGNALS"),
        ("--plot x_m:y_m:half", "no signal"),
        ("--plot shaft_deg", "'shaft_deg' is of several devices: left/shaft_deg, right/shaft_deg"),
        ("--plot left/state", "left/state is a text, as 'Off'; a curve needs numbers"),
        ("--plot a.svg", "it takes names of signals; for the file write -o a.svg"),
        ("-o a.png", "-o needs signals: --plot x_m,y_m"),
        ("--plot x_m -o a.doc", "-o a.doc: the name ends in .png, .svg, .html, .csv"),
        ("--plot x_m -o no/a.csv", "-o no/a.csv: no directory no"),
        ("--plot x_m -o moving.toml", "-o moving.toml: the run reads this file"),
        ("--plot x_m -o a.html --report a.html", "a.html: the run writes this file twice"),
        ("--report a.json", "--report a.json: the name ends in .html, .htm"),
        ("--report no/a.html", "report no/a.html: no directory no"),
    ],
)
def test_what_cannot_be_shown_is_told_before_the_run(words: str, complaint: str) -> None:
    status, out, err = tickrig_run(*VIRTUAL, *words.split())
    assert (status, out) == (2, "")
    assert complaint in err
    assert "ran " not in err


def test_the_page_of_a_run_has_devices_faults_curves_and_how_to_repeat_it(moving: Path) -> None:
    fault = "left/shaft_blocked@500ms-1s"
    words = (*VIRTUAL, "--fault", fault, "--plot", "x_m:y_m", "-o", "a.csv")
    assert tickrig_run(*words, "--report", "run.html")[0] == 0
    page = parse_page((moving / "run.html").read_text())
    assert [one.text for one in page.all("h1")] == ["moving.toml"]
    text = page.text
    for shown in ("left (epos, node-ID 1), right (epos, node-ID 2)", "701#00  boot-up"):
        assert shown in text
    assert "left/shaft_blocked from 0.5 s to 1 s" in " ".join(text.split())
    assert f"tickrig run {' '.join(VIRTUAL)} --fault {fault} --seed 0" in text
    names = {lane.attributes.get("data-name") for lane in page.by_class("lane")}
    assert "left/drive_state" in names
    assert "body/x_m 0 to " in text
    assert "wheel_radius_m = 0.078" in text
    (trace,) = page.all("pre", **{"aria-label": "Trace"})
    (moving / "kept.trace").write_text(trace.text)
    replayed = CliRunner().invoke(replay_command, ["kept.trace"])
    assert replayed.stdout.startswith("identical")


def test_what_a_rig_file_says_is_no_markup_on_the_page(folder: Path) -> None:
    (folder / "<b>&.toml").write_text(
        '# </pre><script>alert(1)</script>\n[device.a]\ntype = "rrc"\n'
    )
    assert tickrig_run("<b>&.toml", "--virtual", "--for", "1s", "--report", "run.html")[0] == 0
    page = parse_page((folder / "run.html").read_text())
    assert [one.text for one in page.all("h1")] == ["<b>&.toml"]
    assert len(page.all("script")) == 1


@contextmanager
def live(*words: str, lines: int) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """Run a bench in a process of its own; yield it and the lines that say where it is."""
    program = "from tickrig.emulators.testing.commands.run_cli import run; run()"
    command = [sys.executable, "-c", program, *words]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, [process.stdout.readline() for _ in range(lines)]
        finally:
            process.kill()


@pytest.mark.realtime
def test_in_real_time_hosts_find_all_devices(folder: Path) -> None:
    real = '[real]\ncontrol = "rig.ctl"\nvr2 = { link = "vr2", serve = "socket://0" }\n'
    real += f'can = {{ interface = "udp_multicast", channel = "{GROUP}" }}\n'
    (folder / "rig.toml").write_text(RIG[: RIG.index("[fault]")] + real)
    with live("rig.toml", lines=3) as (process, lines):
        vr2, lidar, bus = (line.split() for line in lines)
        assert vr2[:2] == ["vr2", "vr2"]
        assert vr2[2].startswith("socket://127.0.0.1:")
        assert bus == f"can udp_multicast {GROUP} 1000000 bit/s left (epos, node-ID 1)".split()
        with ControlClient(folder / "rig.ctl") as control, RrcClient.open("vr2") as client:
            control.request("press", name="vr2/power_button")
            client.wait_for(RrcEvent.POWER_ON_SUCCESS, 10_000_000)
        link = SerialLink(lidar[1], 115_200)
        link.send(b"SCIP2.0\n")
        assert link.receive(10_000_000).startswith(b"SCIP2.0")
        link.close()
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert (process.returncode, "Traceback" in err) == (0, False)
    assert "rig.toml in real time. Ctrl-C ends." in err
    assert not (folder / "vr2").is_symlink()
    assert not (folder / "rig.ctl").exists()


@pytest.mark.realtime
def test_in_real_time_it_ends_by_itself_if_it_shall(folder: Path) -> None:
    with live("rig.toml", "--for", "100ms", lines=3) as (process, lines):
        _, err = process.communicate(timeout=30)
    assert lines[2].startswith("can    -")
    assert (process.returncode, "can: no bus outside" in err) == (0, True)


@pytest.mark.realtime
@pytest.mark.parametrize("mode", [(), ("--virtual", "--for", "999999s")])
def test_ctrl_c_ends_a_run_and_what_was_seen_is_written(
    moving: Path, mode: tuple[str, ...]
) -> None:
    words = ("moving.toml", *mode, "--plot", "half", "-o", "a.csv", "--report", "run.html", "-vv")
    with live(*words, lines=3) as (process, _):
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in err) == (130 if mode else 0, False)
    assert "ran " in err
    assert (moving / "a.csv").read_text().startswith("t_s,half\n")
    assert "moving.toml" in (moving / "run.html").read_text()
