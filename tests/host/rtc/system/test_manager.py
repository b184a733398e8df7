from __future__ import annotations

import pytest

from tests.host.rtc.chain import PERIOD_US, Chain, make_manager
from tests.host.rtc.spy import ERROR, OK, Spy
from tickrig.host.rtc import (
    ExecutionContext,
    InPort,
    LifeCycleState,
    Manager,
    ReturnCode,
    RtComponent,
    RtcRefused,
    connect,
)
from tickrig.host.rtc.components import ConsoleIn, SeqIn, SeqOut
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.rtc import Time, TimedLong, TimedLongSeq


def test_numbers_pass_through_a_chain_unchanged_and_stamped() -> None:
    chain = Chain()
    chain.source.enter(1, -5, 2_147_483_647)
    chain.manager.run_for(3 * PERIOD_US)
    assert chain.sink.received == [
        TimedLong(Time.from_us(1_000), 1),
        TimedLong(Time.from_us(2_000), -5),
        TimedLong(Time.from_us(3_000), 2_147_483_647),
    ]


def test_with_new_a_value_arrives_one_period_later() -> None:
    chain = Chain(subscription_type="new")
    chain.source.enter(1)
    chain.manager.run_for(PERIOD_US)
    assert chain.numbers == []
    chain.manager.run_for(PERIOD_US)
    assert chain.numbers == [1]


def test_a_periodic_connector_pushes_at_its_own_times() -> None:
    chain = Chain(subscription_type="periodic", **{"publisher.push_rate": "400"})
    chain.source.enter(1, 2)
    chain.manager.run_to(2_000)
    assert chain.manager.due_us == 2_500
    chain.manager.run_to(2_999)
    assert chain.numbers == []
    chain.manager.run_to(3_000)
    assert chain.numbers == [2]


@pytest.mark.parametrize("subscription", ["flush", "new", "periodic"])
@pytest.mark.parametrize("step_us", [1, 7, 250, 1_000, 20_000])
def test_however_often_it_is_told_the_time_the_same_happens(
    subscription: str, step_us: int
) -> None:
    keys = {"subscription_type": subscription, "publisher.push_rate": "300"}
    sparse, dense = Chain(**keys), Chain(**keys)
    for chain in (sparse, dense):
        chain.manager.context_of("ConsoleOut0").set_rate(700.0)
        chain.source.enter(*range(20))
    sparse.manager.run_to(20_000)
    for t_us in range(step_us, 20_001, step_us):
        dense.manager.run_to(t_us)
    dense.manager.run_to(20_000)
    assert len(sparse.numbers) >= 5
    assert sparse.sink.received == dense.sink.received


def test_names_have_the_lowest_free_number() -> None:
    manager = make_manager()
    names = [manager.create("ConsoleIn").instance_name for _ in range(3)]
    manager.delete("ConsoleIn1")
    names.append(manager.create("ConsoleIn").instance_name)
    assert names == ["ConsoleIn0", "ConsoleIn1", "ConsoleIn2", "ConsoleIn1"]


def test_components_have_paths_as_in_rtshell() -> None:
    chain = Chain()
    assert chain.manager.names.names() == ("localhost/",)
    assert chain.manager.names.names("localhost") == ("ConsoleIn0.rtc", "ConsoleOut0.rtc")
    assert chain.manager.find("/localhost/ConsoleIn0.rtc") is chain.source
    assert chain.manager.port("localhost/ConsoleIn0.rtc:out") is chain.source.out
    assert chain.manager.port("ConsoleIn0.out") is chain.source.out


def test_what_is_not_there_is_refused_with_what_is() -> None:
    chain = Chain()
    for ask, name, known in (
        (chain.manager.find, "ConsoleIn1", "ConsoleIn0, ConsoleOut0"),
        (chain.manager.find, "localhost/x.rtc", "localhost/ConsoleIn0.rtc"),
        (chain.manager.port, "ConsoleIn0.in", "known: out"),
        (chain.manager.create, "Console", "ConsoleIn, ConsoleOut"),
        (Manager().find, "A0", "known: none"),
        (Manager().create, "A", "known: ConsoleIn, ConsoleOut, SeqIn, SeqOut, ConfigSample"),
    ):
        with pytest.raises(RtcRefused, match=known):
            ask(name)


def test_a_name_is_given_once() -> None:
    manager = make_manager()
    manager.create("ConsoleIn", "A")
    with pytest.raises(RtcRefused, match="'A' is there already"):
        manager.create("ConsoleOut", "A")


def test_the_port_of_a_component_has_its_name_once() -> None:
    component = ConsoleIn("C")
    with pytest.raises(RtcRefused, match="C has a port 'out' already"):
        component.add_port(InPort("out", TimedLong))


def test_a_port_that_is_removed_loses_its_connectors() -> None:
    chain = Chain()
    chain.source.remove_port(chain.source.out)
    assert (chain.sink.in_.connectors, dict(chain.source.ports)) == ((), {})
    assert chain.source.out.full_name == "out"


def test_deleting_ends_connectors_name_and_context() -> None:
    chain = Chain()
    chain.manager.run_for(PERIOD_US)
    chain.manager.delete("ConsoleIn0")
    assert chain.sink.in_.connectors == ()
    assert chain.manager.names.names("localhost") == ("ConsoleOut0.rtc",)
    assert chain.manager.components == (chain.sink,)
    assert not chain.source.alive
    chain.manager.delete("ConsoleOut0")
    assert chain.manager.due_us == NEVER


class Leaver(Spy):
    """Asks for its own end in on_execute, twice."""

    manager: Manager

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        for _ in range(2):
            self.manager.delete(self.instance_name)
        return self.note("on_execute")


def test_a_component_that_deletes_itself_is_gone_at_the_end_of_the_tick() -> None:
    manager = Manager()
    leaver = Leaver("Leaver0")
    leaver.manager = manager
    manager.add(leaver)
    manager.activate("Leaver0")
    manager.run_for(PERIOD_US)
    assert leaver.taken()[-4:] == [
        "on_state_update",
        "on_deactivated",
        "on_shutdown",
        "on_finalize",
    ]
    assert manager.components == ()


def test_who_listens_learns_of_each_component_that_comes_or_goes() -> None:
    manager, seen = make_manager(), list[str]()

    def came(component: RtComponent) -> None:
        assert manager.find(component.instance_name) is component
        seen.append(f"+{component.instance_name}")

    def went(component: RtComponent) -> None:
        assert manager.free_name("ConsoleIn") == component.instance_name
        assert not component.alive
        seen.append(f"-{component.instance_name}")

    manager.on_added.append(came)
    manager.on_removed.append(went)
    manager.create("ConsoleIn")
    manager.delete("ConsoleIn0")
    spy = Spy()
    spy.results["on_initialize"] = ERROR
    with pytest.raises(RtcRefused):
        manager.add(spy)
    assert seen == ["+ConsoleIn0", "-ConsoleIn0"]


def test_a_listener_that_raises_is_logged_and_stops_nobody(
    caplog: pytest.LogCaptureFixture,
) -> None:
    manager, seen = make_manager(), list[str]()
    for listeners in (manager.on_added, manager.on_removed):
        listeners.append(lambda component: 1 / 0)
        listeners.append(lambda component: seen.append(component.instance_name))
    manager.create("ConsoleIn")
    manager.run_for(PERIOD_US)
    manager.delete("ConsoleIn0")
    assert seen == ["ConsoleIn0", "ConsoleIn0"]
    assert [record.getMessage() for record in caplog.records] == [
        "ConsoleIn0: a listener raised",
        "ConsoleIn0: a listener raised",
    ]


def test_a_connector_has_the_id_of_its_caller() -> None:
    manager = Chain().manager
    manager.create("ConsoleOut")
    profile = manager.connect("ConsoleIn0.out", "ConsoleOut1.in", connector_id="9c1f")
    assert (profile.name, profile.connector_id) == ("9c1f", "9c1f")
    connector = manager.port("ConsoleOut1.in").find_connector("9c1f")
    assert connector is not None
    assert connector.ports == (manager.port("ConsoleIn0.out"), manager.port("ConsoleOut1.in"))
    connector.end()
    assert manager.port("ConsoleOut1.in").find_connector("9c1f") is None
    assert [one.connector_id for one in manager.connectors] == ["ConsoleIn0.out_ConsoleOut0.in"]


@pytest.mark.parametrize("known", ["9c1f", "ConsoleIn0.out_ConsoleOut0.in"])
def test_an_id_is_given_once(known: str) -> None:
    manager = Chain().manager
    for name in ("ConsoleIn", "ConsoleOut", "ConsoleOut"):
        manager.create(name)
    manager.connect("ConsoleIn0.out", "ConsoleOut1.in", connector_id="9c1f")
    with pytest.raises(RtcRefused, match=f"a connector '{known}' is there already") as refused:
        manager.connect("ConsoleIn1.out", "ConsoleOut2.in", connector_id=known)
    assert refused.value.code is ReturnCode.PRECONDITION_NOT_MET
    with pytest.raises(RtcRefused, match=f"has a connector '{known}' already"):
        connect(manager.port("ConsoleIn0.out"), manager.port("ConsoleOut2.in"), connector_id=known)
    assert len(manager.connectors) == 2


def test_a_component_that_does_not_initialize_is_not_there() -> None:
    manager, ec = Manager(), ExecutionContext()
    for context in (None, ec):
        spy = Spy()
        spy.results["on_initialize"] = ERROR
        with pytest.raises(RtcRefused, match="on_initialize of Spy0 returned RTC_ERROR") as refused:
            manager.add(spy, context=context)
        assert refused.value.code is ERROR
        assert (manager.components, manager.names.names(), manager.due_us) == ((), (), NEVER)
    assert ec.components == ()


def test_components_in_one_context_run_in_the_order_of_adding() -> None:
    calls: list[str] = []
    manager, ec = Manager(), ExecutionContext(100.0)
    for name in ("B", "A"):
        manager.add(Spy(name, calls), context=ec)
    ec.start()
    manager.activate("A", "B")
    calls.clear()
    manager.run_for(10_000)
    assert [call for call in calls if call.endswith("execute")] == [
        "B.on_execute",
        "A.on_execute",
    ]


def test_a_context_added_late_begins_at_the_present() -> None:
    manager = make_manager()
    manager.run_to(12_345)
    manager.create("ConsoleIn", rate_hz=100.0)
    assert manager.due_us == 20_000


def test_an_operation_a_context_refuses_is_refused_with_the_state() -> None:
    manager = make_manager()
    manager.create("ConsoleIn")
    for ask in (manager.deactivate, manager.reset):
        with pytest.raises(RtcRefused, match=r"\w+ ConsoleIn0: PRECONDITION_NOT_MET, it is INACT"):
            ask("ConsoleIn0")
    manager.activate("ConsoleIn0")
    manager.run_for(PERIOD_US)
    manager.deactivate("ConsoleIn0")
    manager.run_for(PERIOD_US)
    assert manager.state_of("ConsoleIn0") is LifeCycleState.INACTIVE


def test_reset_leads_from_error_to_inactive() -> None:
    manager = Manager()
    spy = manager.add(Spy())
    assert manager.context_of("Spy0").abort_component(spy) is OK
    manager.run_for(PERIOD_US)
    manager.reset("Spy0")
    manager.run_for(PERIOD_US)
    assert manager.state_of("Spy0") is LifeCycleState.INACTIVE


def test_disconnect_ends_a_connector_and_only_once() -> None:
    chain = Chain(subscription_type="new")
    chain.manager.disconnect("ConsoleOut0.in", "ConsoleIn0.out")
    assert chain.manager.connectors == ()
    with pytest.raises(RtcRefused, match="are not connected"):
        chain.manager.disconnect("ConsoleOut0.in", "ConsoleIn0.out")
    chain.manager.connect("ConsoleOut0.in", "ConsoleIn0.out")
    chain.source.enter(1)
    chain.manager.run_for(PERIOD_US)
    assert chain.numbers == [1]


def test_a_port_is_neither_connected_with_itself_nor_disconnected_from_itself() -> None:
    manager = Chain().manager
    with pytest.raises(RtcRefused, match="is one port; a connector joins two"):
        manager.connect("ConsoleIn0.out", "ConsoleIn0.out")
    with pytest.raises(RtcRefused, match="are not connected"):
        manager.disconnect("ConsoleIn0.out", "ConsoleIn0.out")
    assert len(manager.connectors) == 1


def test_a_value_that_waits_makes_the_manager_due_now() -> None:
    chain = Chain(subscription_type="new")
    chain.manager.run_to(1_500)
    chain.source.out.write(TimedLong(data=1))
    assert chain.manager.due_us == 1_500
    chain.manager.run_for(0)
    assert (chain.sink.in_.is_new, chain.manager.due_us) == (True, 2_000)


def test_a_late_tick_runs_one_period() -> None:
    manager = Manager()
    spy = manager.add(Spy())
    manager.activate("Spy0")
    manager.run_for(PERIOD_US)
    spy.taken()
    manager.tick(10 * PERIOD_US)
    assert spy.taken() == ["on_execute", "on_state_update"]


def test_the_profile_of_a_component_has_its_ports() -> None:
    profile = Chain().source.profile
    assert (profile.instance_name, profile.type_name) == ("ConsoleIn0", "ConsoleIn")
    assert [port.name for port in profile.port_profiles] == ["ConsoleIn0.out"]


def test_every_value_of_seq_out_arrives_at_seq_in_through_its_bytes() -> None:
    manager = make_manager()
    out, in_ = manager.add(SeqOut("SeqOut0")), manager.add(SeqIn("SeqIn0"))
    for name in out.outs:
        cdr = {"dataport.interface_type": "corba_cdr"}
        manager.connect(f"SeqOut0.{name}", f"SeqIn0.{name}", cdr)
    manager.activate("SeqOut0", "SeqIn0")
    manager.run_for(300 * PERIOD_US)
    assert in_.latest.keys() == out.outs.keys()
    tm = Time.from_us(300_000)
    assert in_.latest["LongSeq"] == TimedLongSeq(tm, tuple(range(299, 309)))
    assert {value.tm for value in in_.latest.values() if isinstance(value, TimedLong)} == {tm}


def test_console_out_shows_what_arrives() -> None:
    chain = Chain()
    shown: list[TimedLong] = []
    chain.sink.show = shown.append
    chain.source.enter(4)
    chain.manager.run_for(PERIOD_US)
    assert [value.data for value in shown] == [4]
