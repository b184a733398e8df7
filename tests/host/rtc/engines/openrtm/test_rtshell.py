"""The tools of rtshell work with our components as with those of OpenRTM-aist."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.live_system import LiveSystem, has_components, live_system
from tests.host.rtc.engines.openrtm.name_server import eventually

pytestmark = [OMNIORB, pytest.mark.realtime]

EXAMPLE = Path(__file__).parents[5] / "examples" / "rtc_chain.toml"

FAILS = """
from tickrig.rtc import ModuleSpec, ReturnCode, RtComponent

class Fails(RtComponent):
    spec = ModuleSpec("Fails", "Fails in whatever it is told to")

    def __init__(self, instance_name):
        super().__init__(instance_name)
        self.failing = self.configuration.bind("failing", "execute")

    def _result(self, callback):
        wrong = callback in self.failing.value.split()
        return ReturnCode.RTC_ERROR if wrong else ReturnCode.RTC_OK

    def on_activated(self, ec):
        return self._result("activate")

    def on_deactivated(self, ec):
        return self._result("deactivate")

    def on_execute(self, ec):
        return self._result("execute")

    def on_reset(self, ec):
        return self._result("reset")
"""

FAILING = """
[[component]]
name = "Fails0"
type = "Fails"
rate_hz = 100.0
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveSystem]:
    """Return a system that the tests share; each leaves it as it was."""
    folder = tmp_path_factory.mktemp("system")
    (folder / "fails.py").write_text(FAILS, "utf-8")
    (folder / "system.toml").write_text(EXAMPLE.read_text("utf-8") + FAILING, "utf-8")
    words = (str(folder / "system.toml"), "--component", f"{folder / 'fails.py'}:Fails")
    with live_system(folder, *words) as system:
        has_components(system, "ConsoleIn0", "ConsoleOut0", "ConfigSample0", "Fails0")
        yield system


def test_rtls_lists_the_components_and_their_states(system: LiveSystem) -> None:
    assert system.listed() == {
        "manager.mgr": "-",
        "ConsoleIn0.rtc": "Active",
        "ConsoleOut0.rtc": "Active",
        "ConfigSample0.rtc": "Inactive",
        "Fails0.rtc": "Inactive",
    }


def test_rtcat_tells_all_about_a_component(system: LiveSystem) -> None:
    code, out, error = system.tool("rtcat", "-l", "@/ConsoleIn0.rtc")
    assert (code, error) == (0, "")
    assert "ConsoleIn0.rtc  Active" in out
    for title, text in (
        ("Type name", "ConsoleIn"),
        ("Vendor", "tickrig"),
        ("Kind", "Periodic"),
        ("Rate", "100.0"),
        ("Owner", "ConsoleIn0"),
    ):
        assert any(line.split() == [*title.split(), text] for line in out.splitlines()), title


def test_rtcat_tells_about_the_manager(system: LiveSystem) -> None:
    code, out, error = system.tool("rtcat", "@/manager.mgr")
    assert (code, error) == (0, "")
    assert f"Process ID: {system.process.pid}" in out


def test_rtfind_finds_components(system: LiveSystem) -> None:
    code, out, error = system.tool("rtfind", "-t", "c", "-n", "Console*", "@")
    assert (code, error) == (0, "")
    assert {line.rpartition("/")[2] for line in out.split()} == {
        "ConsoleIn0.rtc",
        "ConsoleOut0.rtc",
    }


def test_rtact_and_rtdeact_return_when_it_is_so(system: LiveSystem) -> None:
    assert system.tool("rtact", "@/ConfigSample0.rtc") == (0, "", "")
    assert system.listed()["ConfigSample0.rtc"] == "Active"
    assert system.tool("rtdeact", "@/ConfigSample0.rtc") == (0, "", "")
    assert system.listed()["ConfigSample0.rtc"] == "Inactive"


def test_rtreset_brings_a_component_out_of_error(system: LiveSystem) -> None:
    system.tool("rtact", "@/Fails0.rtc")
    assert system.listed()["Fails0.rtc"] == "Error"
    assert system.tool("rtreset", "@/Fails0.rtc") == (0, "", "")
    assert system.listed()["Fails0.rtc"] == "Inactive"


def test_rtconf_lists_sets_and_activates(system: LiveSystem) -> None:
    code, out, error = system.tool("rtconf", "-l", "@/ConfigSample0.rtc", "list")
    assert (code, error) == (0, "")
    assert "default*" in out
    assert "fast" in out
    assert system.tool("rtconf", "@/ConfigSample0.rtc", "set", "int_param0", "7") == (0, "", "")
    assert system.tool("rtconf", "@/ConfigSample0.rtc", "get", "int_param0") == (0, "7\n", "")
    assert system.tool("rtconf", "-s", "fast", "@/ConfigSample0.rtc", "act") == (0, "", "")
    assert "fast*" in system.tool("rtconf", "@/ConfigSample0.rtc", "list")[1]
    assert system.tool("rtconf", "-s", "default", "@/ConfigSample0.rtc", "act")[0] == 0
    assert system.tool("rtconf", "@/ConfigSample0.rtc", "set", "int_param0", "0")[0] == 0


def test_rtconf_lists_gets_and_sets_text_beyond_latin_1(system: LiveSystem) -> None:
    system.ours("conf", "set", "ConfigSample0", "str_param0", "10 €")
    code, out, error = system.tool("rtconf", "-l", "@/ConfigSample0.rtc", "list")
    assert (code, error) == (0, "")
    assert "10 €" in out
    assert system.tool("rtconf", "@/ConfigSample0.rtc", "get", "str_param0") == (0, "10 €\n", "")
    assert system.tool("rtconf", "@/ConfigSample0.rtc", "set", "str_param0", "Ω") == (0, "", "")
    assert system.tool("rtconf", "@/ConfigSample0.rtc", "get", "str_param0") == (0, "Ω\n", "")
    system.ours("conf", "set", "ConfigSample0", "str_param0", "dara")


def test_rtconf_hides_what_is_for_editors(system: LiveSystem) -> None:
    shown = system.tool("rtconf", "@/ConfigSample0.rtc", "list")[1]
    assert "__constraints__" not in shown
    assert "__constraints__" in system.tool("rtconf", "-a", "@/ConfigSample0.rtc", "list")[1]


def test_rtconf_of_a_value_that_cannot_be_is_refused(system: LiveSystem) -> None:
    code, _, error = system.tool("rtconf", "@/ConfigSample0.rtc", "set", "int_param0", "many")
    assert code == 1
    assert "int_param0 takes a value like 0 (int)" in error


def test_rtdis_and_rtcon_end_and_make_a_connector(system: LiveSystem) -> None:
    ports = ("@/ConsoleIn0.rtc:out", "@/ConsoleOut0.rtc:in")
    assert system.tool("rtdis", *ports) == (0, "", "")
    assert "Connected" not in system.tool("rtcat", "-l", ports[0])[1]
    assert system.tool("rtcon", *ports) == (0, "", "")
    assert "Connected to" in system.tool("rtcat", "-l", ports[0])[1]
    code, _, said = system.tool("rtcon", *ports)
    assert code == 1
    assert "Precondition not met" in said


def test_rtexit_ends_a_component(system: LiveSystem) -> None:
    system.ours("create", "ConsoleOut", "Gone0")
    has_components(system, "Gone0")
    assert system.tool("rtexit", "@/Gone0.rtc") == (0, "", "")
    assert "Gone0.rtc" not in system.listed()


def test_rtdel_takes_a_name_away(system: LiveSystem) -> None:
    system.ours("create", "ConsoleOut", "Unnamed0")
    has_components(system, "Unnamed0")

    def deleted() -> bool:  # it is bound again every 10 s, which may be now
        assert system.tool("rtdel", "@/Unnamed0.rtc") == (0, "", "")
        return "Unnamed0.rtc" not in system.listed()

    eventually(deleted, "it has its name yet")
    system.ours("exit", "Unnamed0")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_at_the_end_no_name_is_left(tmp_path: Path, number: signal.Signals) -> None:
    with live_system(tmp_path, str(EXAMPLE)) as system:
        has_components(system, "ConfigSample0")
        code, said = system.end(number)
        assert code == 0, said
        assert system.tool("rtls", "@") == (0, "", "")


def test_a_killed_system_leaves_zombies_that_rtdel_removes(tmp_path: Path) -> None:
    with live_system(tmp_path, str(EXAMPLE)) as system:
        has_components(system, "ConfigSample0")
        system.end(signal.SIGKILL)
        assert "*ConfigSample0.rtc" in system.listed()
        assert system.tool("rtdel", "-z")[0] == 0
        assert system.tool("rtls", "@") == (0, "", "")
