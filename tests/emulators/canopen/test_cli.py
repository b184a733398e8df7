from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.host.links.slcan_adapter import Adapter
from tests.wire.canopen.eds.xdd_text import XDD
from tickrig.emulators.canopen.cli import main

ROOT = Path(__file__).parents[3]
EDS = "tests/golden/canopen/r1.eds"
DCF = "tests/emulators/canopen/eds/sample.dcf"
PROGRAM = "from tickrig.emulators.canopen.cli import main; main(prog_name='canopen-slave-emu')"


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def run(*words: str | Path, text: str | None = None) -> Result:
    return CliRunner().invoke(main, [str(word) for word in words], input=text)


def play(scenario: str, *words: str | Path) -> Result:
    nodes = words or ("--eds", EDS, "--node-id", "5")
    return run(*nodes, "--scenario", "-", text=scenario)


def frames(result: Result) -> list[str]:
    return re.findall(r"^\(\d{10}\.\d{6}\) \S+ (\S+)$", result.stdout, re.MULTILINE)


def test_the_example_of_the_page_prints_what_it_says(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "reference/devices/canopen-slave-emu.md").read_text("utf-8")
    scenario, log = re.findall(r"```text\n(.*?)```", text, re.DOTALL)
    (tmp_path / "start.txt").write_text(scenario)
    result = run("--eds", EDS, "--node-id", "5", "--scenario", tmp_path / "start.txt")
    assert (result.exit_code, result.stdout) == (0, log)


@pytest.mark.parametrize("command", ["000#8100", "000#8205", "000#0105", "605#4000100000000000"])
def test_a_node_that_is_off_or_initialises_hears_nothing(command: str) -> None:
    scenario = f"0ms send {command}\n10ms end\n"
    assert frames(play(scenario)) == [command, "705#00"]
    scenario = f"9ms set power_off 1\n20200us set power_off 0\n+0s send {command}\n30ms end\n"
    assert frames(play(scenario)) == ["705#00", command, "705#00"]


@pytest.mark.realtime
def test_a_bus_whose_adapter_is_unplugged_ends_the_emulator_with_a_line() -> None:
    adapter = Adapter()
    words = ["--eds", EDS, "--node-id", "5", "-i", "slcan", "-c", adapter.name, "-b", "500k"]
    words += ["--bus-kwargs", "sleep_after_open=0", "timeout=0.01"]
    program = [sys.executable, "-c", PROGRAM, *words]
    with subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as child:
        assert child.stderr is not None
        child.stderr.readline()
        adapter.send(b"t12\r")
        told = child.stderr.readline(), child.stderr.readline()
        adapter.unplug()
        rest = child.stderr.read().splitlines()
    assert child.returncode == 3
    failed = (
        f"CAN bus slcan {adapter.name}: a read has failed: IndexError: string index out of range"
    )
    assert told[1] == f"{failed}; what came is lost\n"
    assert rest[-1].startswith(f"Error: CAN bus slcan {adapter.name}: the last ")


def test_the_log_does_not_depend_on_the_process() -> None:
    words = ["--node", f"1-9={EDS}", "--fault", "corrupt=0.1", "--fault", "3/power_off@20ms-40ms"]
    scenario = "20ms send 000#0100\n+0s set 4/0x1017 10\n60ms fault duplicate=0.5\n100ms end\n"
    logs = {
        subprocess.run(
            [sys.executable, "-c", PROGRAM, *words, "--scenario", "-"],
            input=scenario.encode(),
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT / "src")},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("0", "1")
    }
    assert len(logs) == 1
    assert len(logs.pop().splitlines()) > 40


def test_a_missed_expectation_and_a_refused_value_fail_the_run() -> None:
    result = play("10ms expect 585#* within 5ms\n20ms end\n")
    assert result.exit_code == 1
    assert "0.015000 ? -:1: no line '585#*' within 5 ms of 0.010000\n" in result.stderr
    assert "expectations met: 0; missed: 1" in result.stderr
    refused = play("10ms set 0x1014 0x00000601\n20ms end\n")
    assert refused.exit_code == 1
    assert "0.010000 ? -:1: 0x1014 1537: refused" in refused.stderr


def test_touches_and_watched_things_are_told_beside_the_log() -> None:
    result = play("10ms watch 0x6200:1 state\n20ms send 000#0105\n30ms send 205#1100\n40ms end\n")
    assert "0.001000 * state Pre-operational\n" in result.stderr
    assert "* 0x6200:1 17\n" in result.stderr
    assert frames(result)[:2] == ["705#00", "000#0105"]


def test_states_are_told_with_v() -> None:
    result = play("20ms send 000#0100\n30ms end\n", "--node", f"5-6={EDS}", "-v")
    for name in ("5/state", "6/state"):
        assert f"* {name} Operational\n" in result.stderr


def test_a_dcf_gives_the_node_id() -> None:
    result = play("10ms end\n", "--dcf", DCF)
    assert frames(result)[0].endswith("#00")
    assert frames(play("10ms end\n", "--node", DCF)) == frames(result)
    assert frames(play("10ms end\n", "--dcf", DCF, "--node-id", "7")) == ["707#00"]


def test_an_input_of_a_model_is_set_by_its_name() -> None:
    scenario = "10ms send 000#0110\n20ms set ai1_v 2.5\n+0s set di 1 0 0 0 0 0 0 1\n"
    result = play(
        f"{scenario}30ms watch do1 ai1_v\n40ms send 210#01\n50ms end\n", "--node", "f-palette"
    )
    assert frames(result)[0] == "710#00"
    assert "190#81" in frames(result)
    assert "* do1 1\n" in result.stderr
    assert "* ai1_v 2.5\n" in result.stderr


def test_the_eds_of_a_model_makes_the_same_device(tmp_path: Path) -> None:
    eds = tmp_path / "palette.eds"
    assert run("--model", "f-palette", "--write-eds", eds).output == ""
    printed = run("--model", "f-palette", "--write-eds", "-").stdout.splitlines()
    written = eds.read_text("utf-8").splitlines()
    assert printed[1].startswith("FileName=")
    assert written[1] == "FileName=palette.eds"
    assert printed[2:] == written[2:]
    odd = tmp_path / "palette ;1.eds"
    assert run("--model", "f-palette", "--write-eds", odd).output == ""
    assert odd.read_text("utf-8").splitlines() == printed
    scenario = "10ms send 000#0110\n20ms set di1 1\n30ms send 610#4001140100000000\n50ms end\n"
    assert frames(play(scenario, "--model", "f-palette")) == frames(
        play(scenario, "--eds", eds, "--node-id", "16")
    )


def test_an_eds_that_is_not_by_the_standard_is_used_and_said_so_once(tmp_path: Path) -> None:
    eds = tmp_path / "odd.eds"
    eds.write_text("[2000]\nParameterName=x\nDataType=5\nAccessType=rw\nDefaultValue=7U\n")
    result = play(
        "1ms send 605#4000200000000000\n9ms end\n", "--node", f"5={eds}", "--node", f"6={eds}"
    )
    assert "585#4F00200007000000" in frames(result)
    line = f"{eds}:5: [2000] DefaultValue=7U is no number of CiA 306: 7 is taken (number-form)"
    assert result.stderr.splitlines().count(line) == 1


def test_values_that_an_eds_leaves_open_are_told_once_for_all_nodes(tmp_path: Path) -> None:
    file = tmp_path / "drive.eds"
    rows = ((0x1000, 7), (0x6040, 6), (0x6041, 6), (0x6060, 2), (0x6065, 7), (0x6081, 7))
    file.write_text(
        "".join(
            f"[{index:04X}]\nParameterName=x\nDataType={kind}\nAccessType=rw\n"
            for index, kind in rows
        )
    )
    hint = f"{file}: 1000h has no value: no profile; use --profile 402"
    told = play("1ms end\n", "--node", f"1-3={file}").stderr
    assert (told.count(hint), told.count("no DefaultValue")) == (1, 0)
    told = play("1ms end\n", "--node", f"1-3={file}", "--profile", "402").stderr
    assert told.splitlines()[0] == (
        f"{file}: no DefaultValue for 3 values of CiA 402: those of the profile are taken, as"
        " 1000h=0x00000192, 6065h=0xFFFFFFFF, 6081h=0x00002710"
    )
    assert told.count("no DefaultValue") == 1


def test_an_eds_that_cannot_be_used_says_all_that_is_wrong(tmp_path: Path) -> None:
    eds = tmp_path / "bad.eds"
    eds.write_text(
        "[2000]\nParameterName=x\nDataType=5\nDefaultValue=300\n"
        "[2001]\nParameterName=y\nDataType=5\nAccessType=rw\nDefaultValue=six\n"
    )
    result = run("--eds", eds, "--node-id", "5")
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [
        f"Error: {eds}:4: [2000] DefaultValue=300 is no UNSIGNED8 (default-value)",
        f"{eds}:9: [2001] DefaultValue=six is no UNSIGNED8 (default-value)",
    ]


def test_sdo_servers_have_the_limits_that_are_asked_for() -> None:
    result = play(
        "1ms send 605#2107200009000000\n90ms end\n",
        *("--eds", EDS, "--node-id", "5", "--sdo-timeout", "50ms"),
    )
    assert "585#8007200000000405" in frames(result)
    result = play(
        "1ms send 605#2107200009000000\n9ms end\n",
        *("--eds", EDS, "--node-id", "5", "--sdo-memory", "8"),
    )
    assert "585#8007200005000405" in frames(result)


def test_a_rig_file_names_the_nodes(tmp_path: Path) -> None:
    eds = ROOT / EDS
    rig = tmp_path / "rig.toml"
    rig.write_text(
        f'[device.a]\ntype = "{eds}"\nnode_id = 5\n[device.b]\ntype = "{eds}"\nnode_id = 7\n'
        f'[device.c]\ntype = "{eds}"\nnode_id = "lss"\n[device.d]\ntype = "{ROOT / DCF}"\n'
        '[device.palette]\ntype = "f-palette"\nnode_id = 17\n'
        f'[device.bare]\ntype = "{eds}"\nnode_id = 9\nprofile = "none"\n'
    )
    result = play("1ms set a/di1 1\n10ms end\n", "--rig", rig, "--node", f"20={eds}")
    assert {"705#00", "707#00", "709#00", "711#00", "714#00"} < set(frames(result))
    assert len(frames(result)) == 6
    assert "no input 'bare/di1'" in play("1ms set bare/di1 1\n", "--rig", rig).stderr


EPOS = '[device.a]\ntype = "epos"\n'


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "rig.toml:1: no device: a rig file has tables [device.NAME] with a type"),
        (
            '[[node]]\nid = 5\neds = "a.eds"',
            "rig.toml:1: node[1]: [[node]] is a device now, one for each node-ID: [device.node1]"
            ' with type = "a.eds", node_id = 5',
        ),
        ("[[node", "rig.toml:1: "),
        (EPOS + "node_id = 0", "rig.toml:3: device.a.node_id: "),
        (EPOS + '[device.b]\ntype = "rrc"', "more than nodes on one bus (device b): tickrig run"),
        (EPOS + '[fault]\na = "power_off"', "more than nodes on one bus (faults): tickrig run"),
        (EPOS + "[device.a.start]\nsupply_v = {sine = [20, 28], period = '1s'}", "(signals)"),
        (EPOS + "[signal]\nx = {sine = [20, 28], period = '1s'}", "(signals): tickrig run"),
        (
            EPOS + "wire='x'\n[device.b]\ntype = 'epos'\nwire='y'\n[wire.x]\ntype='can'\n"
            "[wire.y]\ntype='can'",
            "(several wires): tickrig run",
        ),
    ],
)
def test_a_wrong_rig_file_is_one_line(tmp_path: Path, text: str, error: str) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(text)
    result = play("10ms end\n", "--rig", rig)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert error in result.stderr


def test_a_node_of_a_rig_file_begins_as_the_file_says(tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(f"{EPOS}[device.a.start]\nsupply_v = 20\n")
    assert "* supply_v 20" in play("1ms watch supply_v\n2ms end\n", "--rig", rig).stderr
    twice = play("1ms end\n", "--rig", rig, "--node", "1=epos")
    assert (twice.exit_code, twice.stderr) == (2, "Error: node 1 is there twice: epos, a\n")


def test_what_is_stored_outlives_the_run(tmp_path: Path) -> None:
    store = tmp_path / "store.json"
    words = ("--eds", EDS, "--node-id", "5", "--store", store)
    save = "10ms send 605#2B17100064000000\n20ms send 605#2310100173617665\n40ms end\n"
    assert "585#6010100100000000" in frames(play(save, *words))
    assert json.loads(store.read_bytes())["nodes"]["5"]["parameters"]["1017:00"] == "6400"
    assert frames(play("250ms end\n", *words)) == ["705#00", "705#7F", "705#7F"]


def test_a_store_that_cannot_be_written_is_told_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = tmp_path / "gone" / "store.json"
    save = "10ms send 605#2310100173617665\n+20ms send 605#2310100173617665\n50ms end\n"
    assert play(save, "--eds", EDS, "--node-id", "5", "--store", store).exit_code == 0
    assert [record.getMessage().split(": ", 1)[1] for record in caplog.records] == [
        "No such file or directory; the emulator goes on"
    ]


def test_the_trace_is_the_log(tmp_path: Path) -> None:
    trace = tmp_path / "bus.log"
    result = play("20ms end\n", "--eds", EDS, "--node-id", "5", "--trace", trace)
    assert trace.read_text("ascii") == result.stdout


@pytest.mark.parametrize("spec", ["sdo_mute", "5/sdo_mute", "5/drop", "sdo_slow=1s@10ms-2s"])
def test_a_fault_hits_one_node(spec: str) -> None:
    nodes = (["--node", f"5={EDS}"], ["--node", f"5={EDS}", "--node", f"6={EDS}"])
    text = "20ms send 605#4000100000000000\n20ms send 606#4000100000000000\n100ms end\n"
    for words in nodes if "/" in spec else nodes[:1]:
        heard = [frame[:3] for frame in frames(play(text, *words, "--fault", spec))]
        assert "585" not in heard or "drop" in spec
        assert ("586" in heard) is (len(words) > 2)
    result = play(f"10ms fault {spec}\n{text}", "--node", f"5={EDS}")
    assert f"{spec.partition('@')[0].removeprefix('5/')}\n" in result.stderr


def test_lss_finds_a_node_without_node_id() -> None:
    result = play("10ms send 7E5#4C00000000000000\n20ms end\n", "--eds", EDS, "--node-id", "lss")
    assert frames(result) == ["7E5#4C00000000000000", "7E4#5000000000000000"]
    result = play("10ms end\n", "--node", f"lss={EDS}", "--node", f"lss={EDS}", "-v")
    assert "* lss2/state Initialising\n" in result.stderr


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (
            "",
            "no node: give --eds FILE --node-id N, --model NAME, --rtc, --node, --rig FILE or"
            " --bus FILE",
        ),
        ("--node-id 5", "--node-id belongs to --eds, --dcf, --model or --rtc; with --node write"),
        (f"--eds {EDS} --dcf {DCF}", "--eds and --dcf name the same thing: give one of them"),
        (f"--dcf {DCF} --model f-palette", "--dcf and --model name the same thing"),
        ("--model epos --write-eds - --trace t", "--trace does nothing here: --write-eds writes"),
        ("--model epos --profile 402", "--profile does nothing here: it is for nodes of an EDS"),
        (f"--eds {EDS} --write-eds x.eds", "--write-eds belongs to --model or --rtc"),
        ("--model f-palette --write-eds /nowhere/x", "EDS /nowhere/x: No such file"),
        (f"--node 5={EDS} --profile 402 --node 5=f-palette", "node 5 is there twice"),
        (f"--eds {EDS}", f"{EDS} gives no node-ID: add --node-id 1..127, or --node-id lss"),
        (f"--eds {EDS} --node-id 128", "--node-id: a node-ID is 1..127, a range as 1-20, or lss"),
        (f"--eds {EDS} --node-id five", "--node-id: a node-ID is 1..127"),
        (f"--node 9-5={EDS}", f"--node 9-5={EDS}: a node-ID is 1..127"),
        (f"--eds {EDS} --node-id 5 --sdo-timeout soon", "--sdo-timeout: 'soon' is not a time"),
        (
            f"--eds {EDS} --node-id 5 --sdo-timeout 0",
            "--sdo-timeout: an SDO time-out of 0 us is less than 1 us",
        ),
        (f"--eds {EDS} --node-id 5 --sdo-memory much", "--sdo-memory: 'much' is not a size"),
        ("--node 5=", "--node 5=: give ID=FILE or ID=MODEL, as 5=a.eds"),
        (f"--node 5={EDS} --node 4-6={EDS}", f"node 5 is there twice: {EDS}, {EDS}"),
        ("--eds nowhere.eds --node-id 5", "file nowhere.eds: No such file or directory"),
        ("--rig nowhere.toml", "rig nowhere.toml: No such file or directory"),
        ("--eds README.md --node-id 5", "README.md: "),
        (f"--node 5={EDS} -b 5", "bit rate 5 is not in 10000..1000000 bit/s"),
        (f"--node 5={EDS} --fault fire", "--fault: no fault 'fire'; known: drop, corrupt"),
        (f"--node 5={EDS} --fault drop=2", "--fault: drop takes a rate above 0 and up to 1"),
        (f"--node 5={EDS} --store README.md", "store README.md: not a store file"),
        (f"--node 5={EDS} --store .", "store .: Is a directory"),
        (f"--node 5={EDS} --trace /nowhere/x", "trace /nowhere/x: No such file or directory"),
    ],
)
def test_a_users_mistake_is_one_line_and_status_2(words: str, error: str) -> None:
    result = run(*words.split(), "--scenario", "-", text="10ms end\n")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1), result.stderr
    assert result.stderr.startswith(f"Error: {error}")


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("send 705", "-:1: '705' is not a frame like 705#7F"),
        ("raw 00", "-:1: no action 'raw'; known: send, set, press"),
        ("set 0x5000 1", "-:1: no input '0x5000'; known: di, di9_16, power_off"),
        ("set 0x6000:1 256", "-:1: 0x6000:1 256 is not in 0..255"),
        ("press 0x6000:1", "-:1: no button '0x6000:1'; known: none"),
        ("watch smell", "-:1: no output 'smell'; known: state, node_id, can_state"),
    ],
)
def test_a_wrong_line_of_a_scenario_says_where(line: str, error: str) -> None:
    result = play(f"1ms {line}\n")
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {error}")


def test_without_a_bus_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("can.util.CONFIG_FILES", [])
    for name in ("CAN_INTERFACE", "CAN_CHANNEL", "CAN_CONFIG"):
        monkeypatch.delenv(name, raising=False)
    result = run("--eds", EDS, "--node-id", "5")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "give -i INTERFACE -c CHANNEL" in result.stderr


def test_it_tells_its_version_and_its_options() -> None:
    assert re.fullmatch(r"\S+ \(tickrig\) \S+\n", run("--version").stdout)
    told = run("--help").stdout
    for option in ("--eds", "--bus-kwargs", "--store", "--control", "-b, --bitrate"):
        assert option in told


def test_many_values_follow_one_option() -> None:
    result = run(
        *("--eds", EDS, "--node-id", "5", "-i", "virtual"),
        *("--bus-kwargs", "a=1", "b=2", "c-d", "--control", "/nowhere/x"),
    )
    assert result.stderr.endswith("Got unexpected extra argument (c-d)\n")


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("--st", "plain,--store\n"),
        ("--model f-p", "plain,f-palette\nplain,f-palette-boot\n"),
        ("--node 5=f-p", "plain,5=f-palette\nplain,5=f-palette-boot\nfile,5=f-p\n"),
        ("--profile n", "plain,none\n"),
    ],
)
def test_the_shell_completes_options_and_models(words: str, completed: str) -> None:
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={
            "PYTHONPATH": str(ROOT / "src"),
            "_CANOPEN_SLAVE_EMU_COMPLETE": "bash_complete",
            "COMP_WORDS": f"canopen-slave-emu {words}",
            "COMP_CWORD": str(len(words.split())),
        },
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout == completed


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_recording_that_ended_early_is_exit_status_3() -> None:
    result = run("--model", "epos", "--scenario", "-", "--trace", "/dev/full", text="0.1 end")
    assert result.exit_code == 3
    assert result.stderr.endswith("the recording ended early: /dev/full: No space left on device\n")


def test_a_slave_is_made_of_an_xdd(tmp_path: Path) -> None:
    xdd = tmp_path / "lamp.xdd"
    xdd.write_text(XDD, "utf-8")
    result = play("1ms send 605#4014100000000000\n9ms end\n", "--node", f"5={xdd}")
    assert "585#4314100085000000" in frames(result)


def test_an_xdd_with_a_document_type_is_refused(tmp_path: Path) -> None:
    xdd = tmp_path / "bomb.xdd"
    xdd.write_text('<!DOCTYPE a [<!ENTITY b "b">]><a>&b;</a>', "utf-8")
    result = run("--eds", xdd, "--node-id", "5")
    line = f"Error: {xdd}:1: has a document type, which is refused (xml)"
    assert (result.exit_code, result.stderr.splitlines()) == (2, [line])
