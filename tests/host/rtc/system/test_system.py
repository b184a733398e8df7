"""System files: what is saved is restored, in TOML and as RTSProfile."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.rtc.chain import PERIOD_US, Chain, make_manager
from tickrig.host.rtc import (
    Consumer,
    ExecutionContext,
    LifeCycleState,
    Manager,
    ModuleSpec,
    Provider,
    RtComponent,
    RtcRefused,
    ServicePort,
)
from tickrig.host.rtc.components import ConsoleOut
from tickrig.host.rtc.system.rts_profile import parse_rts_profile, write_rts_profile
from tickrig.host.rtc.system.system import (
    ComponentEntry,
    ConnectionEntry,
    System,
    describe,
    restore,
    with_remotes,
)
from tickrig.host.rtc.system.system_file import parse_toml, write_toml

GOLDEN = Path(__file__).parents[3] / "golden" / "rtc_chain.xml"


def configured() -> Chain:
    """Return a chain with a configured component beside it, all in one saved state."""
    chain = Chain(subscription_type="periodic", **{"publisher.push_rate": "500.0"})
    sample = chain.manager.create("ConfigSample", rate_hz=50.0)
    sample.configuration.set("str_param0", 'with "quotes", \\ and \x7f あ')
    sample.configuration.add_set("fast", {"int_param0": "99"})
    sample.configuration.activate("fast")
    chain.manager.run_for(PERIOD_US)
    return chain


@pytest.mark.parametrize("form", ["toml", "xml"])
def test_the_id_of_a_caller_is_saved_and_restored(form: str) -> None:
    manager = Chain().manager
    manager.create("ConsoleOut")
    manager.connect("ConsoleIn0.out", "ConsoleOut1.in", connector_id="9c1f-\u3042")
    saved = (
        parse_toml(write_toml(describe(manager)))
        if form == "toml"
        else parse_rts_profile(write_rts_profile(manager))
    )
    assert [one.connector_id for one in saved.connections] == ["", "9c1f-\u3042"]
    assert restored(saved).connectors == manager.connectors


def restored(system: System) -> Manager:
    manager = make_manager()
    restore(manager, system)
    manager.run_for(20 * PERIOD_US)
    return manager


def test_a_system_is_restored_from_toml_as_it_was_saved() -> None:
    system = describe(configured().manager)
    read = parse_toml(write_toml(system))
    assert read == system
    assert describe(restored(read)) == system


def test_a_restored_system_runs() -> None:
    manager = restored(parse_toml(write_toml(describe(configured().manager))))
    source, sink = manager.find("ConsoleIn0"), manager.find("ConsoleOut0")
    assert isinstance(sink, ConsoleOut)
    getattr(source, "enter")(5)  # noqa: B009 - whatever type it is
    manager.run_for(5 * PERIOD_US)
    assert [value.data for value in sink.received] == [5]
    assert manager.find("ConfigSample0").configuration.parameters["int_param0"].value == 99


def test_components_that_share_a_context_share_one_again() -> None:
    manager = make_manager()
    for rate_hz in (100.0, 200.0):
        ec = ExecutionContext(rate_hz)
        for _ in range(2):
            manager.create("ConsoleIn", context=ec)
        ec.start()
    read = parse_toml(write_toml(describe(manager)))
    assert [entry.context for entry in read.components] == ["shared0"] * 2 + ["shared1"] * 2
    again = restored(read)
    assert len(again.context_of("ConsoleIn0").components) == 2
    assert [again.context_of(c.instance_name).rate_hz for c in again.components] == [
        100.0,
        100.0,
        200.0,
        200.0,
    ]


COMPONENT = '[[component]]\nname = "A"\ntype = "T"\n'


def test_what_is_left_out_has_its_default() -> None:
    connection = "[[connection]]\nports = ['A.b', 'C.d']"
    system = parse_toml(f"{COMPONENT}rate_hz = 10\n{connection}")
    assert system == System((ComponentEntry("A", "T", 10.0),), (ConnectionEntry(("A.b", "C.d")),))
    assert parse_toml("") == System()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = ", "line 1: a value is missing before the end of the line"),
        ("a = " + "[" * 20_000, "line 1: nested deeper than 50"),
        ("[[components]]", "line 1: no key 'components'; did you mean 'component'?"),
        ("[component]\nname = 'A'", "component: it is a table [[component]], not [component]"),
        ("component = [1]", "component[1]: it is a table [[component]], not 1"),
        ("[[component]]\nname = 'A'", "line 1: component[1]: no key 'type': its type, a text"),
        (COMPONENT + "speed = 1", "line 4: component[1]: no key 'speed'; known: name, type"),
        (COMPONENT + "active = 1", "component[1].active: it takes true or false, not 1"),
        (COMPONENT + "rate_hz = true", "line 4: component[1].rate_hz: it takes a number"),
        (COMPONENT + "[component.configuration]\nset = 1", "configuration.set: it takes lines"),
        (COMPONENT + "[component.configuration.set]\na = 1", "configuration.set: it takes lines"),
        ("[[connection]]", "line 1: connection[1]: no key 'ports': what it connects"),
        ("[[connection]]\nports = ['A.b']", "line 2: connection[1].ports: it takes two ports"),
        ("[[connection]]\nports = ['A.b', 1]", "ports: it takes two ports"),
        ("[[connection]]\nports = ['A.b', 'C.d']\n[connection.properties]\na = 1", "properties"),
        (COMPONENT + "a = 1\nb = 2", "line 4: component[1]: no key 'a'; known: name, type"),
        (COMPONENT + "a = 1\nb = 2", "(and 1 mistake more)"),
    ],
)
def test_a_mistake_in_a_system_file_is_told_in_one_line(text: str, said: str) -> None:
    with pytest.raises(RtcRefused, match=re.escape(said)) as refused:
        parse_toml(text)
    assert "\n" not in str(refused.value)


CONSOLE = ComponentEntry("A", "ConsoleIn")


@pytest.mark.parametrize(
    ("system", "said"),
    [
        (System((CONSOLE, ComponentEntry("B", "Unknown"))), "no component type 'Unknown'"),
        (System((CONSOLE,), (ConnectionEntry(("A.out", "B.in")),)), "no component 'B'"),
        (System((CONSOLE, ComponentEntry("B", "ConsoleIn", 0.0))), "rate 0.0 Hz"),
        (System((ComponentEntry("A", "ConsoleIn", configuration_set="x"),)), "A: no configuration"),
        (
            System((CONSOLE, ComponentEntry("S", "ConfigSample", configuration={"s": {"a": "1"}}))),
            "S: no parameter 'a'",
        ),
    ],
)
def test_nothing_is_left_of_a_system_that_cannot_be_restored(system: System, said: str) -> None:
    manager = make_manager()
    with pytest.raises(ValueError, match=said):
        restore(manager, system)
    assert (manager.components, manager.names.names()) == ((), ())


NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=5)
TEXTS = st.dictionaries(NAMES, NAMES, max_size=2)


@given(
    st.builds(
        System,
        st.lists(
            st.builds(
                ComponentEntry,
                NAMES,
                NAMES,
                st.floats(1.0, 1e6),
                NAMES,
                st.booleans(),
                NAMES,
                st.dictionaries(NAMES, TEXTS, max_size=2),
            ),
            max_size=3,
        ).map(tuple),
        st.lists(st.builds(ConnectionEntry, st.tuples(NAMES, NAMES), NAMES, TEXTS), max_size=2).map(
            tuple
        ),
    )
)
def test_any_system_survives_toml(system: System) -> None:
    assert parse_toml(write_toml(system)) == system


@given(st.text(max_size=60))
def test_noise_is_a_system_or_refused(text: str) -> None:
    for parse in (parse_toml, parse_rts_profile):
        try:
            assert isinstance(parse(text), System)
        except RtcRefused as refused:
            assert str(refused)  # noqa: PT017 - a parser may also succeed


class Caller(RtComponent):
    spec = ModuleSpec("Caller", category="test")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.service = self.add_port(ServicePort("service"))
        self.service.require(Consumer[object]("thing", "Thing"))


class Called(RtComponent):
    spec = ModuleSpec("Called", category="test")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.service = self.add_port(ServicePort("service"))
        self.service.provide(Provider("thing", "Thing", object()))


def with_services(manager: Manager) -> Manager:
    manager.register(Caller)
    manager.register(Called)
    return manager


def test_an_rts_profile_is_written_byte_by_byte() -> None:
    chain = configured()
    chain.manager.find("ConfigSample0").configuration.set("str_param0", "plain", "default")
    with_services(chain.manager).create("Caller")
    chain.manager.create("Called")
    chain.manager.connect("Caller0.service", "Called0.service")
    text = write_rts_profile(chain.manager, "chain", date="2010-09-02T12:00:00")
    assert text == GOLDEN.read_text("utf-8")


def test_a_system_is_restored_from_its_rts_profile_but_inactive() -> None:
    manager = with_services(make_manager())
    restore(manager, parse_rts_profile(GOLDEN.read_text("utf-8")))
    assert {manager.state_of(c.instance_name) for c in manager.components} == {
        LifeCycleState.INACTIVE
    }
    assert write_rts_profile(manager, "chain", date="2010-09-02T12:00:00") == GOLDEN.read_text(
        "utf-8"
    )


def test_what_the_library_of_rtshell_made_of_our_file_is_the_same_system() -> None:
    theirs = GOLDEN.with_name("rtc_chain_rtsprofile.xml")
    ours = parse_rts_profile(GOLDEN.read_text("utf-8"))
    assert parse_rts_profile(theirs.read_text("utf-8")) == ours


SAMPLE = """<?xml version="1.0" encoding="UTF-8"?>
<r:RtsProfile xmlns:r="http://www.openrtp.org/namespaces/rts"
 xmlns:e="http://www.openrtp.org/namespaces/rts_ext">
<r:Components r:id="RTC:Vendor:Category:ConsoleIn:1.0" r:instanceName="In0">
<r:ConfigurationSets r:id="__widget__">
<r:ConfigurationData r:name="a" r:data="text"/></r:ConfigurationSets>
<r:ExecutionContexts r:rate="500.0"/></r:Components>
<r:Components r:id="RTC:Vendor:Category:ConsoleOut:1.0" r:instanceName="Out0"/>
<r:DataPortConnectors r:name="c" r:interfaceType="CORBA_CDR" r:dataflowType="PUSH"
 r:subscriptionType="Periodic" r:pushInterval="0.5">
<r:sourceDataPort r:portName="out" r:instanceName="In0"/>
<r:targetDataPort r:portName="Out0.in" r:instanceName="Out0"/>
<e:Properties e:name="dataport.buffer.length" e:value="4"/>
<e:Properties e:name="dataport.data_type" e:value="IDL:RTC/TimedLong:1.0"/></r:DataPortConnectors>
<r:StartUp/>
</r:RtsProfile>"""


def test_an_rts_profile_of_an_editor_is_read() -> None:
    system = parse_rts_profile(SAMPLE)
    assert system.components == (
        ComponentEntry("In0", "ConsoleIn", 500.0),
        ComponentEntry("Out0", "ConsoleOut"),
    )
    (connection,) = system.connections
    assert connection.ports == ("In0.out", "Out0.in")
    assert connection.properties == {
        "dataport.interface_type": "corba_cdr",
        "dataport.dataflow_type": "push",
        "dataport.subscription_type": "periodic",
        "dataport.publisher.push_rate": "2.0",
        "dataport.buffer.length": "4",
    }
    restored(system)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("<r:StartUp/>", "<r:StartUp>"), "not XML"),
        (("r:RtsProfile", "r:Profile"), "is not an RTSProfile"),
        (("RTC:Vendor:Category:ConsoleIn:1.0", "ConsoleIn"), "ConsoleIn is not like RTC:"),
        ((' r:instanceName="In0">\n<r:Conf', ">\n<r:Conf"), "Components without instanceName"),
        (('"500.0"', '"fast"'), "rate 'fast' is not a number"),
        (("targetDataPort", "otherPort"), "DataPortConnectors without targetDataPort"),
        (('r:id="__widget__"', ""), "ConfigurationSets without id"),
    ],
)
def test_a_mistake_in_an_rts_profile_is_told(change: tuple[str, str], said: str) -> None:
    assert change[0] in SAMPLE
    with pytest.raises(RtcRefused, match=re.escape(said)):
        parse_rts_profile(SAMPLE.replace(*change))


REMOTE = """
[[component]]
name = "ConsoleIn0"
type = "ConsoleIn"

[[connection]]
ports = ["{first}", "{second}"]

[[remote]]
name = "Far0"
path = "localhost:2809/far.host_cxt/Far0.rtc"
"""


def remote_system(first: str = "ConsoleIn0.out", second: str = "Far0.in") -> System:
    return parse_toml(REMOTE.format(first=first, second=second))


def test_connectors_with_remote_components_are_left_to_an_engine() -> None:
    manager = make_manager()
    restore(manager, remote_system())
    (wanted,) = manager.remotes.connections
    assert (wanted.port, wanted.remote.name, wanted.remote_port) == ("ConsoleIn0.out", "Far0", "in")
    assert wanted.connector_id == "ConsoleIn0.out_Far0.in"
    assert parse_toml(write_toml(describe(manager))) == describe(manager)


@pytest.mark.parametrize(
    ("first", "second", "reason"),
    [
        ("Far0.out", "Far0.in", "Far0.out and Far0.in both run elsewhere"),
        ("ConsoleIn0.none", "Far0.in", "ConsoleIn0 has no port 'none'; known: out"),
    ],
)
def test_what_cannot_be_joined_with_remote_components_is_refused(
    first: str, second: str, reason: str
) -> None:
    manager = make_manager()
    with pytest.raises(RtcRefused, match=reason):
        restore(manager, remote_system(first, second))
    assert (manager.components, manager.remotes.components) == ((), [])


def test_a_component_that_is_here_does_not_run_elsewhere() -> None:
    manager = make_manager()
    manager.create("ConsoleIn", "Far0")
    with pytest.raises(RtcRefused, match="Far0 is here and runs elsewhere, too"):
        restore(manager, remote_system())


def test_components_of_unknown_types_run_where_an_rtsprofile_says() -> None:
    text = GOLDEN.read_text("utf-8").replace(":ConsoleOut:", ":Display:")
    system = with_remotes(parse_rts_profile(text), ("ConsoleIn", "ConfigSample"))
    assert "ConsoleOut0" in {entry.name for entry in system.remotes}
