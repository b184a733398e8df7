from __future__ import annotations

from tests.emulators.lamp import Lamp
from tickrig.emulators.record.wire_log import WireLog
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.text.trace import Mark


def test_a_line_is_heard_when_its_last_byte_has_arrived() -> None:
    emulator = Emulator("lamp", Lamp())
    for _ in range(10):
        emulator.step()
    (line,) = emulator.log.since(0)
    assert (line.at_us, line.mark, line.data) == (1_261, Mark.FROM_DEVICE, b"hi")


def test_an_emulator_with_nothing_to_do_stays_where_it_is() -> None:
    emulator = Emulator("lamp", Lamp(b""))
    for _ in range(10):
        emulator.step()
    assert emulator.rig.now_us == 1_000


def test_an_action_comes_before_the_tick_of_its_time() -> None:
    emulator, seen = Emulator("lamp", Lamp(b"")), list[tuple[int, int]]()

    def act(now_us: int) -> None:
        seen.append((now_us, emulator.effective_us))
        emulator.operator.set("lamp", 0)

    emulator.event_queue.put("act", 5_000, act)
    emulator.event_queue.put(
        "odd", 5_500, lambda now_us: seen.append((now_us, emulator.effective_us))
    )
    for _ in range(5):
        emulator.step()
    assert seen == [(5_000, 5_000), (5_500, 5_500)]


def test_what_is_done_between_ticks_takes_effect_at_the_next_one() -> None:
    emulator = Emulator("lamp", Lamp(b""))
    assert emulator.effective_us == 0
    emulator.step()
    assert (emulator.rig.now_us, emulator.effective_us) == (1_000, 2_000)


def test_bytes_that_find_a_buffer_full_are_counted() -> None:
    emulator = Emulator("lamp", Lamp())
    emulator.send(0, bytes(5_000))
    assert emulator.lost == {"lost_bytes": 904}
    assert emulator.status()["lost_bytes"] == 904


def test_the_log_keeps_the_latest_lines_whole() -> None:
    log, heard = WireLog(keep=2), list[bytes]()
    log.listeners.append(lambda line: heard.append(line.data))
    for chunk in (b"a\nb", b"b\nc\n", b"unfinished"):
        log.hear(7, Mark.TO_DEVICE, chunk)
    assert [(line.number, line.data) for line in log.since(0)] == [(2, b"bb"), (3, b"c")]
    assert log.since(3) == ()
    assert heard == [b"a", b"bb", b"c"]
