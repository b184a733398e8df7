"""What peers bring is let in at the next tick."""

from __future__ import annotations

from tests.host.rtc.chain import PERIOD_US, make_manager
from tickrig.host.rtc import InPort
from tickrig.host.rtc.components import ConsoleOut
from tickrig.host.rtc.engines.peer_ports import InPortPushConnector, PeerEnd, cdr
from tickrig.host.rtc.system.call_queue import Arrivals, CallQueue
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.rtc import Time, TimedLong


def test_a_value_is_there_when_components_run_and_not_before() -> None:
    manager, calls, arrivals = make_manager(), CallQueue(), Arrivals()
    manager.add_item(arrivals)
    sink = manager.add(ConsoleOut("ConsoleOut0"))
    port: InPort[TimedLong] = sink.in_
    codec = cdr(TimedLong)
    connector = InPortPushConnector(port, PeerEnd("peer", "a"), codec, calls, arrivals.post)
    connector.begin()
    manager.activate("ConsoleOut0")
    value = TimedLong(Time(1, 2), 5)
    assert connector.put(codec.encode(value)).name == "PORT_OK"
    assert not port.is_new
    calls.serve(0)  # nobody was woken
    assert not port.is_new
    manager.run_for(PERIOD_US)
    assert sink.received == [value]
    calls.close()


def test_arrivals_make_no_tick_come_earlier() -> None:
    manager, arrivals = make_manager(), Arrivals()
    manager.add_item(arrivals)
    arrivals.post(lambda: None)
    assert (arrivals.due_us, manager.due_us) == (NEVER, NEVER)
