"""The event log."""

from __future__ import annotations

from tickrig.host.rtc.canopen.events import KEPT, EventLog, ServerEvent, ServerEventType


def test_an_event_is_a_line_for_people_and_one_for_programs() -> None:
    event = ServerEvent(1_006_055, ServerEventType.HEARTBEAT_LOST, 16, "300 ms")
    assert str(event) == "1.006055 HeartbeatLost node 16: 300 ms"
    assert str(ServerEvent(0, ServerEventType.BUS_ON)) == "0.000000 BusOn"
    assert event.to_json() == (
        '{"at_us": 1006055, "event": "HeartbeatLost", "node": 16, "text": "300 ms"}'
    )


def test_listeners_hear_all_and_the_log_keeps_the_latest() -> None:
    log, heard = EventLog(), list[ServerEvent]()
    log.listeners.append(heard.append)
    for at_us in range(KEPT + 5):
        log.notify(at_us, ServerEventType.BOOT_UP, 1)
    assert len(heard) == KEPT + 5
    assert [event.at_us for event in log.events] == list(range(5, KEPT + 5))
