"""The three components of environment position detection, with an emulated reader and service."""

from __future__ import annotations

import logging

import pytest

from tests.host.rtc.ucode.bench import DOOR, LIFT, NOBODY, SECOND_US, UcodeBench, values
from tickrig.device.ucode_reader import Marker
from tickrig.host.links.link import LinkClosed
from tickrig.host.rtc import Manager
from tickrig.host.rtc.ucode.infrared_rays_reader import InfraredRaysReader
from tickrig.host.rtc.ucode.ucode_settlement import UcodeSettlement
from tickrig.wire.rtc_types.rtc import Point2D, TimedStringSeq


@pytest.fixture
def bench() -> UcodeBench:
    return UcodeBench()


def points(bench: UcodeBench) -> list[Point2D]:
    return [value.data for value in values(bench.positions)]


def test_a_marker_becomes_a_place(bench: UcodeBench) -> None:
    bench.run(420_000)
    rounds = values(bench.ucodes)
    assert [value.data for value in rounds] == [(DOOR,), (DOOR,)]
    words = (DOOR, "http://127.0.0.1:8640/contents/door")
    assert [value.data for value in values(bench.addresses)] == [words, words]
    assert points(bench) == [Point2D(1, 0), Point2D(1, 0)]
    assert [value.data for value in values(bench.places)] == [(DOOR, "name=door of room 1")] * 2


def test_what_is_found_late_has_the_time_at_which_it_was_received(bench: UcodeBench) -> None:
    bench.service.inputs.set("slow", 1)
    bench.service.inputs.set("delay_ms", 250)
    bench.run(1_200_000)
    bench.service.inputs.set("slow", 0)
    first = values(bench.addresses)[0]
    received = [value.tm for value in values(bench.ucodes)]
    assert first.tm in received[:4]
    assert points(bench)[0] == Point2D(1, 0)


def test_the_second_time_the_cache_answers(bench: UcodeBench) -> None:
    bench.run(3 * SECOND_US)
    assert bench.service.read("requests") == 2  # the address, and what is there
    hits, stale, misses, unknown, failures, entries, age_ms = values(bench.settled)[-1].data
    assert (stale, misses, unknown, failures, entries) == (0, 1, 0, 0, 1)
    assert hits >= 25
    assert 2_500 <= age_ms <= 3_000


def test_an_outage_is_ridden_out_by_the_caches(
    bench: UcodeBench, caplog: pytest.LogCaptureFixture
) -> None:
    for name in ("Settlement0", "Contents0"):
        bench.manager.find(name).configuration.set("fresh", "0.5")
    bench.run(2 * SECOND_US)
    points(bench)
    bench.service.inputs.set("unreachable", 1)
    bench.run(10 * SECOND_US)
    assert points(bench) == [Point2D(1, 0)] * 100
    assert bench.settlement.cache.counts.stale > 80
    assert 8 <= bench.settlement.cache.counts.failures <= 11
    bench.service.inputs.set("unreachable", 0)
    bench.run(2 * SECOND_US)
    told = [r.getMessage() for r in caplog.records if r.getMessage().startswith("Settlement0")]
    assert len(told) == 2
    assert told[0].startswith("Settlement0: the service does not answer: http://127.0.0.1:8640/uco")
    assert told[1].startswith("Settlement0: the service answers again, after ")
    assert caplog.records[0].levelno == logging.WARNING


def test_what_is_kept_for_too_long_serves_no_more(bench: UcodeBench) -> None:
    bench.contents.configuration.set("keep", "2")
    bench.contents.configuration.set("fresh", "1")
    bench.run(SECOND_US)
    bench.service.inputs.set("unreachable", 1)
    bench.run(4 * SECOND_US)
    points(bench)
    bench.run(SECOND_US)
    assert points(bench) == []


def test_a_place_first_seen_in_an_outage_is_not_known_until_it_ends(bench: UcodeBench) -> None:
    bench.run(SECOND_US)
    bench.service.inputs.set("unreachable", 1)
    bench.go(3, 2.5)
    points(bench)
    bench.run(3 * SECOND_US)
    assert Point2D(4, 2.5) not in points(bench)
    bench.service.inputs.set("unreachable", 0)
    bench.run(2 * SECOND_US)
    assert Point2D(4, 2.5) in points(bench)
    assert values(bench.places)[-1].data == (LIFT, "floor=2", "name=lift")


def test_who_waited_too_long_is_elsewhere(bench: UcodeBench) -> None:
    bench.settlement.configuration.set("retry", "4")
    bench.service.inputs.set("unreachable", 1)
    bench.run(400_000)
    bench.service.inputs.set("unreachable", 0)
    bench.go(-50, 0)
    bench.run(6 * SECOND_US)
    assert values(bench.addresses) == []


def test_a_ucode_that_nobody_knows_is_not_asked_for_each_time() -> None:
    bench = UcodeBench(Marker(NOBODY, 1, 0))
    bench.run(5 * SECOND_US)
    counts = bench.settlement.cache.counts
    assert (bench.service.read("requests"), values(bench.addresses)) == (1, [])
    assert (counts.hits, counts.misses - counts.unknown) == (0, 1)
    bench.run(10 * SECOND_US)
    assert bench.service.read("requests") == 2


def test_answers_that_are_none_are_told_and_not_used(
    bench: UcodeBench, caplog: pytest.LogCaptureFixture
) -> None:
    bench.service.inputs.set("broken", 1)
    bench.run(3 * SECOND_US)
    assert values(bench.addresses) == []
    told = {record.getMessage() for record in caplog.records}
    assert told == {
        f"Settlement0: http://127.0.0.1:8640/ucodes/{DOOR}: 'out of order' is no address, http://..."
    }


def test_what_is_no_ucode_is_counted(bench: UcodeBench) -> None:
    list(bench.settlement._wanted(TimedStringSeq(data=("", "x" * 5_000, DOOR, "../../etc"))))
    assert bench.settlement.invalid_ucodes == 3


def test_a_flood_of_ucodes_is_bounded(bench: UcodeBench) -> None:
    bench.settlement.configuration.set("entries", "10")
    bench.service.inputs.set("slow", 1)
    flood = TimedStringSeq(data=tuple(f"{n:032X}" for n in range(2_000)))
    bench.run(100_000)
    bench.rays.ucodes.write(flood)
    bench.run(10_000)
    assert bench.service.read("requests") == 10
    assert len(bench.settlement._waiting) == 10
    bench.run(30 * SECOND_US)
    assert len(bench.settlement._waiting) <= 1


def test_inactive_it_asks_nobody_and_remembers(bench: UcodeBench) -> None:
    bench.run(SECOND_US)
    bench.manager.deactivate("Settlement0")
    bench.run(SECOND_US)
    values(bench.addresses)
    bench.service.inputs.set("unreachable", 1)
    bench.manager.activate("Settlement0")
    bench.run(SECOND_US)
    assert values(bench.addresses)[-1].data[0] == DOOR


def test_a_reader_that_loses_power_is_told_and_comes_back(
    bench: UcodeBench, caplog: pytest.LogCaptureFixture
) -> None:
    bench.run(SECOND_US)
    bench.reader.inputs.set("power_cut", 1)
    bench.run(3 * SECOND_US)
    values(bench.ucodes)
    bench.reader.inputs.set("power_cut", 0)
    bench.run(2 * SECOND_US)
    assert len(values(bench.ucodes)) >= 15
    assert [record.getMessage() for record in caplog.records] == [
        "Rays0: the reader is silent",
        "Rays0: the reader is back",
    ]


def test_too_much_light_is_told_once(bench: UcodeBench, caplog: pytest.LogCaptureFixture) -> None:
    bench.run(SECOND_US)
    bench.reader.inputs.set("sunlight", 1)
    bench.run(SECOND_US)
    assert values(bench.ucodes)[-1].data == ()
    bench.reader.inputs.set("sunlight", 0)
    bench.run(SECOND_US)
    assert [record.getMessage() for record in caplog.records] == [
        "Rays0: too much light: nothing is received",
        "Rays0: it receives again",
    ]


def test_a_line_that_cannot_be_opened_is_an_error(caplog: pytest.LogCaptureFixture) -> None:
    def fail(name: str) -> None:
        raise LinkClosed(f"cannot open {name!r}")

    manager = Manager()
    manager.add(InfraredRaysReader("Rays0", fail), 100)  # type: ignore[arg-type]
    manager.activate("Rays0")
    manager.run_for(20_000)
    assert manager.state_of("Rays0").name == "ERROR"
    assert caplog.records[0].getMessage() == "Rays0: cannot open '/dev/ttyUSB0'"


def test_a_line_that_is_lost_is_an_error_that_a_reset_ends(bench: UcodeBench) -> None:
    bench.run(SECOND_US)
    assert bench.rays.client is not None
    bench.rays.client._link.close()
    bench.run(20_000)
    assert bench.manager.state_of("Rays0").name == "ERROR"
    bench.manager.reset("Rays0")
    bench.run(20_000)
    bench.manager.activate("Rays0")
    values(bench.ucodes)
    bench.run(SECOND_US)
    assert len(values(bench.ucodes)) >= 8


def test_they_are_created_by_their_names() -> None:
    manager = Manager()
    for name in ("InfraredRaysReader", "UcodeSettlement", "ContentsInterpretation"):
        assert manager.create(name).spec.type_name == name
    assert isinstance(manager.find("UcodeSettlement0"), UcodeSettlement)


def test_the_same_run_is_the_same() -> None:
    def run() -> list[object]:
        bench = UcodeBench()
        bench.port.arm("flip", "0.001")
        bench.service.inputs.set("slow", 1)
        bench.run(5 * SECOND_US)
        return [*values(bench.ucodes), *values(bench.positions), bench.settlement.cache.counts]

    assert run() == run()
