"""Requests to a running system: whatever comes in is answered, and the system runs on."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.host.rtc.chain import Chain
from tickrig.host.rtc import ModuleSpec, RtComponent
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.system.schedule import RealTime


class NoClock:
    """Waits for nothing."""

    def wait_until(self, t_us: int, /) -> int:
        return 0


class Bench(Chain):
    """A chain that is asked between its periods."""

    def __init__(self) -> None:
        super().__init__()
        self.manager.create("ConfigSample")
        self.runner = RealTime(self.manager, NoClock())
        self.control = SystemControl(self.manager, self.runner)

    def ask(self, do: str, **fields: object) -> Any:
        """Make a request, and run a period."""
        line = json.dumps({"v": 1, "do": do, **fields}).encode()
        answer = json.loads(self.control.answer_line(line))
        self.runner.step()
        return answer

    def refused(self, do: str, **fields: object) -> str:
        answer = self.ask(do, **fields)
        assert not answer["ok"]
        error: str = answer["error"]
        return error


@pytest.mark.parametrize(
    ("do", "fields", "error"),
    [
        ("describe", {"names": "ConsoleIn0"}, 'names is a list of some names, not "ConsoleIn0"'),
        ("describe", {"names": [1]}, "names is a list of some names, not [1]"),
        ("connect", {"ports": ["ConsoleIn0.out"]}, "ports is a list of 2 names, not"),
        ("connect", {}, "ports is a list of 2 names, not null"),
        (
            "connect",
            {"ports": ["ConsoleIn0.out", "ConsoleOut0.in"], "properties": {"a": 1}},
            'properties are strings by name, not {"a": 1}',
        ),
        ("disconnect", {"ports": []}, "ports are one or two names, not 0"),
        ("activate", {"name": 5}, "name is a string, not 5"),
        ("set_parameter", {"name": "ConfigSample0", "value": 5}, "value is a string, not 5"),
        (
            "add_set",
            {"name": "ConfigSample0", "set": "x", "like": "none"},
            'no configuration set "none"; known: default',
        ),
        ("seen", {"port": "ConsoleIn0.out", "since": "1"}, 'since is a whole number, not "1"'),
        ("inject", {"port": "ConsoleOut0.in"}, "inject needs a value"),
        ("save", {"format": "yaml"}, 'format is toml or xml, not "yaml"'),
        ("create", {"type": "SeqIn", "rate_hz": True}, "rate_hz is a number, not true"),
        ("eval", {}, 'no request "eval"; known: describe, create, connect, '),
    ],
)
def test_a_bad_request_is_refused(do: str, fields: dict[str, object], error: str) -> None:
    assert Bench().refused(do, **fields).startswith(error)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("dataport.buffer.length", "9" * 30),
        ("dataport.buffer.length", "0"),
        ("dataport.publisher.push_rate", "5e-324"),
        ("dataport.publisher.push_rate", "nan"),
        ("dataport.publisher.push_rate", "1e9"),
    ],
)
def test_a_connector_that_cannot_be_is_refused(key: str, value: str) -> None:
    bench = Bench()
    bench.manager.disconnect("ConsoleIn0.out", "ConsoleOut0.in")
    properties = {"dataport.subscription_type": "periodic", key: value}
    error = bench.refused(
        "connect", ports=["ConsoleIn0.out", "ConsoleOut0.in"], properties=properties
    )
    assert key.split(".")[1] in error


def test_a_listener_of_a_port_that_raises_ends_nothing(caplog: pytest.LogCaptureFixture) -> None:
    def raises(profile: ConnectorProfile) -> None:
        raise KeyError(profile.name)

    bench = Bench()
    bench.source.out.on_disconnect.append(raises)
    assert bench.ask("disconnect", ports=["ConsoleIn0.out"])["ok"]
    assert bench.manager.connectors == ()
    assert "ConsoleIn0.out: a listener raised" in caplog.text


def test_a_component_in_no_execution_context_is_described() -> None:
    bench = Bench()
    component = bench.manager.find("ConfigSample0")
    bench.manager.context_of("ConfigSample0").remove_component(component)
    (described,) = bench.ask("describe", names=["ConfigSample0"])["components"]
    assert (described["state"], described["contexts"]) == ("CREATED", [])
    assert bench.refused("activate", name="ConfigSample0") == (
        "ConfigSample0 takes part in no execution context"
    )


class Raises(RtComponent):
    """A component that cannot be made."""

    spec = ModuleSpec("Raises")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        raise KeyError("a\nb")


def test_a_component_whose_constructor_raises_ends_nothing() -> None:
    bench = Bench()
    bench.manager.register(Raises)
    assert bench.refused("create", type="Raises") == r"Raises: KeyError: 'a\nb'"


VERBS = (
    *("create", "describe", "connect", "disconnect", "activate", "deactivate", "reset", "delete"),
    *("set_parameter", "add_set", "activate_set", "seen", "inject", "save", "status", "stop"),
)
FIELDS: dict[str, list[Any]] = {
    "names": [["ConsoleIn0"], ["localhost/ConsoleOut0.rtc"], []],
    "ports": [["ConsoleIn0.out", "ConsoleOut0.in"], ["ConsoleIn0"], ["ConsoleOut0.in"]],
    "properties": [{}, {"dataport.subscription_type": "new"}, {"dataport.buffer.length": "9"}],
    "name": ["ConsoleIn0", "ConsoleOut0", "ConfigSample0", "localhost/ConsoleIn0.rtc", ""],
    "parameter": ["int_param0", "vector_param0", "str_param1"],
    "value": [5, "5", "1,2", [1], {"data": 3}],
    "set": ["default", "fast", ""],
    "like": ["default", "none"],
    "type": ["ConsoleIn", "SeqOut"],
    "rate_hz": [10, 0.5],
    "port": ["ConsoleIn0.out", "ConsoleOut0.in", ":", "."],
    "since": [0, -1, 10**30],
    "format": ["toml", "xml"],
}
SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6)
JSON = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner),
    max_leaves=6,
)


@st.composite
def requests(draw: st.DrawFn) -> tuple[str, dict[str, object]]:
    fields = draw(st.lists(st.sampled_from(sorted(FIELDS)), max_size=4, unique=True))
    known = {name: st.sampled_from(FIELDS[name]) for name in fields}
    return draw(st.sampled_from(VERBS)), {name: draw(known[name] | JSON) for name in fields}


@settings(max_examples=50)
@given(st.lists(requests(), max_size=12))
def test_whatever_is_asked_is_answered_and_the_others_run_on(
    asked: list[tuple[str, dict[str, object]]],
) -> None:
    bench = Bench()
    for do, fields in asked:
        answer = bench.ask(do, **fields)
        assert answer["ok"] or "\n" not in answer["error"]
    assert bench.ask("describe")["ok"]
