"""The verbs of `tickrig rtc` on a running system."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.rtc.commands.served import Served
from tests.host.rtc.spy import ERROR
from tickrig.emulators.commands.cli import main
from tickrig.host.rtc import Provider, ServicePort
from tickrig.host.rtc.system.rts_profile import parse_rts_profile
from tickrig.host.rtc.system.system import System, describe, differences
from tickrig.host.rtc.system.system_file import parse_toml


@pytest.fixture
def system(tmp_path: Path) -> Iterator[Served]:
    with Served(tmp_path / "ctl") as served:
        yield served


def test_ls_lists_the_components(system: Served) -> None:
    names = ["ConsoleIn0", "ConsoleOut0", "ConfigSample0", "SeqOut0"]
    assert system.rtc("ls").split() == names
    assert system.rtc("ls", "localhost/SeqOut0.rtc").split() == ["SeqOut0"]


def test_ls_l_shows_state_ports_rate_and_type(system: Served) -> None:
    lines = system.rtc("ls", "-l").splitlines()
    assert lines[0].split() == ["Active", "1/1", "1000Hz", "ConsoleIn", "ConsoleIn0"]
    assert lines[-1].split() == ["Inactive", "10/0", "1000Hz", "SeqOut", "SeqOut0"]


def test_cat_shows_ports_with_their_types_and_connectors(system: Served) -> None:
    text = system.rtc("cat", "ConsoleOut0")
    assert text.startswith("ConsoleOut0  Active\n  Path          localhost/ConsoleOut0.rtc\n")
    assert "  DataInPort    ConsoleOut0.in  TimedLong\n    connected to ConsoleIn0.out\n" in text
    assert "dataport" not in text
    assert "      dataport.subscription_type = flush\n" in system.rtc("cat", "-l", "ConsoleOut0")


def test_cat_shows_the_configuration(system: Served) -> None:
    system.manager.find("ConfigSample0").configuration.add_set("fast", {"int_param0": "9"})
    text = system.rtc("cat", "-l", "ConfigSample0")
    assert "  Parameter     int_param0 = 0  [0<=x<=150]\n" in text
    assert "  Set           default *\n    int_param0 = 0\n" in text
    assert text.endswith("  Set           fast\n    int_param0 = 9\n")


def test_cat_shows_the_interfaces_of_a_service_port(system: Served) -> None:
    port = system.manager.find("SeqOut0").add_port(ServicePort("cart"))
    port.provide(Provider("cart0", "Cart", None))
    text = system.rtc("cat", "SeqOut0")
    assert "  CorbaPort     SeqOut0.cart\n    provided cart0 (Cart)\n" in text


@pytest.mark.parametrize("verb", ["ls", "cat"])
def test_json_has_all_that_there_is_to_know(system: Served, verb: str) -> None:
    (component,) = json.loads(system.rtc(verb, "--json", "ConsoleIn0"))
    assert (component["type"], component["state"]) == ("ConsoleIn", "ACTIVE")
    assert component["ports"][0]["connectors"][0]["ports"] == ["ConsoleIn0.out", "ConsoleOut0.in"]


def test_dis_and_con_end_and_make_a_connector(system: Served) -> None:
    system.rtc("dis", "ConsoleIn0.out", "ConsoleOut0.in")
    assert not system.manager.connectors
    words = ["-p", "subscription_type=new", "-p", "dataport.buffer.length=3", "-n", "main"]
    system.rtc("con", "ConsoleIn0.out", "localhost/ConsoleOut0.rtc:in", *words)
    (connector,) = system.manager.connectors
    assert connector.name == "main"
    assert connector.properties["dataport.subscription_type"] == "new"
    assert connector.properties["dataport.buffer.length"] == "3"


@pytest.mark.parametrize("name", ["ConsoleIn0.out", "ConsoleOut0", "localhost/ConsoleIn0.rtc"])
def test_dis_ends_all_connectors_of_a_port_or_a_component(system: Served, name: str) -> None:
    system.rtc("dis", name)
    assert system.manager.connectors == ()


def test_deact_and_act_return_when_the_components_are_there(system: Served) -> None:
    both = ("ConsoleIn0", "ConsoleOut0")
    system.rtc("deact", *both)
    assert [system.manager.state_of(name).name for name in both] == ["INACTIVE"] * 2
    system.rtc("act", *both)
    assert [system.manager.state_of(name).name for name in both] == ["ACTIVE"] * 2


def test_reset_brings_a_component_out_of_error(system: Served) -> None:
    component = system.manager.find("ConsoleIn0")
    system.manager.context_of("ConsoleIn0").abort_component(component)
    while system.manager.state_of("ConsoleIn0").name != "ERROR":
        pass
    system.rtc("reset", "ConsoleIn0")
    assert system.manager.state_of("ConsoleIn0").name == "INACTIVE"


def test_act_of_a_component_that_fails_says_where_it_went(
    system: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(system.manager.find("SeqOut0"), "on_activated", lambda ec: ERROR)
    assert system.rtc("act", "SeqOut0", exit_code=1) == "Error: SeqOut0 is ERROR, not ACTIVE\n"


def test_act_that_waits_for_nothing_only_asks(
    system: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(system.manager.find("SeqOut0"), "on_activated", lambda ec: ERROR)
    system.rtc("act", "SeqOut0", "--wait", "0")


def test_create_makes_a_component_and_prints_its_name(system: Served) -> None:
    assert system.rtc("create", "SeqOut", "--rate", "50") == "SeqOut1\n"
    assert system.rtc("create", "SeqIn", "Sink") == "Sink\n"
    assert system.manager.context_of("SeqOut1").rate_hz == 50
    system.rtc("act", "Sink")


def test_exit_ends_a_component(system: Served) -> None:
    system.rtc("exit", "ConsoleIn0", "SeqOut0")
    assert system.rtc("ls").split() == ["ConsoleOut0", "ConfigSample0"]


def test_conf_lists_gets_sets_and_activates(system: Served) -> None:
    system.rtc("conf", "set", "ConfigSample0", "int_param0", "5")
    system.rtc("conf", "set", "ConfigSample0", "vector_param0", "-1,2.5")
    system.manager.find("ConfigSample0").configuration.add_set("fast", {"int_param0": "9"})
    system.rtc("conf", "act", "ConfigSample0", "fast")
    system.rtc("conf", "set", "ConfigSample0", "int_param1", "7", "--set", "fast")
    system.rtc("status")
    assert system.rtc("conf", "get", "ConfigSample0", "int_param0") == "9\n"
    text = system.rtc("conf", "list", "-l", "ConfigSample0")
    assert "Parameter     int_param1 = 7  [0<=x<=1000]\n" in text
    assert "Set           fast *\n" in text
    assert "  vector_param0 = -1,2.5\n" in text


def test_inject_writes_into_an_inport(system: Served) -> None:
    system.rtc("inject", "ConsoleOut0.in", "-5")
    system.rtc("inject", "ConsoleOut0.in", '{"tm": {"sec": 3, "nsec": 0}, "data": 2147483647}')
    system.rtc("deact", "ConsoleOut0")
    assert system.numbers == [-5, 2_147_483_647]
    assert system.sink.received[1].tm.us == 3_000_000


def test_print_shows_what_an_outport_writes(system: Served) -> None:
    system.manager.activate("SeqOut0")
    lines = system.rtc("print", "SeqOut0.Long", "-n", "3").splitlines()
    stamps, numbers = zip(*[line.split() for line in lines], strict=True)
    assert [int(number) - int(numbers[0]) for number in numbers] == [0, 1, 2]
    assert [round(1e6 * (float(stamp) - float(stamps[0]))) for stamp in stamps] == [0, 1_000, 2_000]


def test_print_shows_values_as_json(system: Served) -> None:
    system.manager.activate("SeqOut0")
    (line,) = system.rtc("print", "SeqOut0.OctetSeq", "-n", "1", "--json").splitlines()
    value = json.loads(line)
    assert set(value) == {"tm", "data"}
    assert len(value["data"]) == 10


def test_print_ends_after_a_time(system: Served) -> None:
    assert system.rtc("print", "ConsoleIn0.out", "--for", "1ms") == ""


def test_save_writes_the_system_as_it_is(system: Served, tmp_path: Path) -> None:
    system.rtc("exit", "SeqOut0")
    expected = describe(system.manager)
    assert parse_toml(system.rtc("save")) == expected
    system.rtc("save", str(tmp_path / "system.toml"))
    assert parse_toml((tmp_path / "system.toml").read_text("utf-8")) == expected
    system.rtc("save", str(tmp_path / "system.XML"))
    read = parse_rts_profile((tmp_path / "system.XML").read_text("utf-8"))
    assert [entry.name for entry in read.components] == [
        "ConsoleIn0",
        "ConsoleOut0",
        "ConfigSample0",
    ]


def test_status_and_stop(system: Served) -> None:
    assert system.rtc("status").splitlines()[0] == "components 4"
    assert json.loads(system.rtc("status", "--json"))["late_ticks"] == 0
    system.rtc("stop")
    assert not system.runner.running


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["cat", "Nobody0"], "no component 'Nobody0'; known: ConsoleIn0, ConsoleOut0, "),
        (["create", "Seq"], "no component type 'Seq'; known: ConsoleIn, ConsoleOut, SeqIn, "),
        (["create", "SeqIn", "SeqOut0"], "a component 'SeqOut0' is there already"),
        (["con", "ConsoleIn0.out", "SeqOut0.Long"], "DataOutPort ConsoleIn0.out, DataOutPort Seq"),
        (["con", "ConsoleIn0.out", "ConsoleOut0.in"], "and ConsoleOut0.in are connected"),
        (["con", "ConsoleIn0.out", "ConsoleOut0.in", "-p", "x"], "-p 'x' is not KEY=VALUE"),
        (["dis", "ConsoleIn0.out", "SeqOut0.Long"], "SeqOut0.Long are not connected"),
        (["dis", "a", "b", "c"], "ports are one or two names, not 3"),
        (["act", "ConsoleIn0"], "activate ConsoleIn0: PRECONDITION_NOT_MET, it is ACTIVE"),
        (
            ["act", "SeqOut0", "--wait", "x"],
            "--wait: 'x' is not a time: write 1.5s, 200ms or",
        ),
        (["conf", "set", "ConfigSample0", "int_param0", "151"], "151 is not in 0<=x<=150"),
        (["conf", "set", "ConfigSample0", "x", "1"], "no parameter 'x'; known: int_param0, "),
        (["conf", "get", "SeqOut0", "x"], "no parameter 'x'; known: none"),
        (["conf", "act", "SeqOut0", "x"], "no configuration set 'x'; known: default"),
        (["print", "ConsoleOut0.in"], "is a DataInPort; values are shown of a DataOutPort"),
        (["print", "SeqOut0.Long", "--for", "x"], "--for: 'x' is not a time"),
        (
            ["inject", "ConsoleOut0.in", "1+1"],
            "'1+1' is not JSON, as 5, [1, 2], true or ",
        ),
        (["inject", "ConsoleOut0.in", "2147483648"], "is no IDL:RTC/TimedLong:1.0"),
        (["save", "system.yaml"], "system system.yaml: the name ends in .toml or .xml"),
        (["save", "no/dir/x.toml"], "system no/dir/x.toml: No such file or directory"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(system: Served, words: list[str], error: str) -> None:
    before = describe(system.manager)
    output = system.rtc(*words, exit_code=2)
    assert error in output
    assert len(output.splitlines()) == 1
    assert describe(system.manager) == before


def test_a_system_that_does_not_run_is_told(tmp_path: Path) -> None:
    path = tmp_path / "none"
    result = CliRunner().invoke(main, ["rtc", "ls", "--at", str(path)])
    assert result.exit_code == 2
    assert (
        result.output
        == f"Error: socket {path}: No such file or directory, is the system running?\n"
    )


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("tickrig rtc act Con", "ConsoleIn0 ConsoleOut0 ConfigSample0"),
        ("tickrig rtc create Seq", "SeqIn SeqOut"),
        ("tickrig rtc con ConsoleI", "ConsoleIn0.out"),
        ("tickrig rtc inject SeqOut0.Do", "SeqOut0.Double SeqOut0.DoubleSeq"),
    ],
)
def test_the_shell_completes_names(system: Served, words: str, found: str) -> None:
    env = {
        "TICKRIG_RTC": str(system.path),
        "_TICKRIG_COMPLETE": "bash_complete",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }
    result = CliRunner().invoke(main, [], env=env, prog_name="tickrig")
    assert result.output.split() == [f"plain,{name}" for name in found.split()]


def test_without_a_system_the_shell_completes_nothing(tmp_path: Path) -> None:
    env = {
        "XDG_RUNTIME_DIR": str(tmp_path),
        "_TICKRIG_COMPLETE": "bash_complete",
        "COMP_WORDS": "tickrig rtc act Con",
        "COMP_CWORD": "3",
    }
    assert CliRunner().invoke(main, [], env=env, prog_name="tickrig").output.strip() == ""


def test_ls_r_shows_the_ports_of_each_component(system: Served) -> None:
    assert system.rtc("ls", "-R", "ConsoleIn0", "ConsoleOut0").splitlines() == [
        "ConsoleIn0",
        "  DataOutPort   ConsoleIn0.out  TimedLong",
        "ConsoleOut0",
        "  DataInPort    ConsoleOut0.in  TimedLong",
    ]
    assert system.rtc("ls", "-lR", "ConsoleIn0").splitlines()[0].startswith("Active")


@pytest.mark.parametrize("ending", [".toml", ".xml"])
def test_check_tells_what_the_system_lacks_of_a_file(
    system: Served, tmp_path: Path, ending: str
) -> None:
    file = str(tmp_path / f"system{ending}")
    system.rtc("save", file)
    assert system.rtc("check", file) == ""
    system.rtc("exit", "SeqOut0")
    system.rtc("dis", "ConsoleIn0")
    system.rtc("conf", "set", "ConfigSample0", "int_param0", "7")
    told = system.rtc("check", file, exit_code=1).splitlines()
    assert "SeqOut0 is not there" in told
    assert "ConfigSample0: int_param0 of the set default is 7, not 0" in told
    assert "ConsoleIn0.out and ConsoleOut0.in are not connected" in told


def test_check_looks_at_types_rates_states_sets_and_properties(
    system: Served, tmp_path: Path
) -> None:
    file = tmp_path / "system.toml"
    system.rtc("save", str(file))
    wanted = parse_toml(file.read_text("utf-8"))
    system.rtc("deact", "ConsoleIn0")
    system.rtc("dis", "ConsoleIn0")
    system.rtc("con", "ConsoleOut0.in", "ConsoleIn0.out", "-p", "buffer.length=3")
    text = file.read_text("utf-8").replace('"SeqOut"', '"SeqIn"')
    file.write_text(text, "utf-8")
    told = system.rtc("check", str(file), exit_code=1).splitlines()
    assert "ConsoleIn0 is not Active" in told
    assert "SeqOut0 is a SeqOut, not a SeqIn" in told
    first, *rest = wanted.components
    changed = replace(first, rate_hz=5.0, active=False, configuration_set="fast")
    found = System((changed, *rest), wanted.connections)
    assert list(differences(wanted, found)) == [
        "ConsoleIn0 runs at 5 Hz, not at 1000 Hz",
        "ConsoleIn0 is not Active",
        "ConsoleIn0 has the set fast, not default",
    ]
    (connection,) = wanted.connections
    asked = replace(connection, properties={"dataport.buffer.length": "4"})
    (line,) = differences(System((), (asked,)), describe(system.manager))
    assert line.endswith("ConsoleOut0.in: dataport.buffer.length is 3, not 4")


def test_dot_draws_the_system(system: Served) -> None:
    lines = system.rtc("dot").splitlines()
    assert lines[0] == "digraph system {"
    assert '  "ConsoleOut0" [label="{<in> in}|ConsoleOut0\\nConsoleOut\\ Active"];' in lines
    assert lines[-2:] == ['  "ConsoleIn0":"out" -> "ConsoleOut0":"in";', "}"]
