from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.lamp import Lamp
from tickrig import Bench
from tickrig.device import make_epos
from tickrig.device.chance import Chance, threshold_of
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.can.faults import CAN_FAULTS, NARROWED
from tickrig.emulators.canopen.choices import MODELS
from tickrig.emulators.canopen.faults import NODE_FAULTS
from tickrig.emulators.commands.device_type import DEVICES
from tickrig.emulators.rig.faults import _SYNONYMS as SYNONYMS
from tickrig.emulators.rig.faults import (
    FaultArgument,
    FaultArguments,
    FaultForm,
    FaultyPort,
    bind_arguments,
    near_fault,
    usage,
)
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.instant import NEVER


class Loop:
    """A port that gives back what it is sent."""

    due_us = 42

    def __init__(self) -> None:
        self.traffic = b""

    def poll(self, now_us: int, /) -> bytes:
        traffic, self.traffic = self.traffic, b""
        return traffic

    def send(self, now_us: int, traffic: bytes, /) -> None:
        self.traffic += traffic


def faulty(seed: int = 0) -> tuple[FaultyPort[bytes], Loop]:
    loop = Loop()
    return FaultyPort(loop, BYTE_FAULTS, seed), loop


def received(port: FaultyPort[bytes], loop: Loop, *chunks: bytes) -> bytes:
    out = b""
    for chunk in chunks:
        loop.traffic = chunk
        out += port.poll(0)
    return out


def test_without_a_fault_all_passes() -> None:
    port, loop = faulty()
    port.send(0, b"abc")
    assert port.poll(0) == b"abc"
    assert port.due_us == loop.due_us


def test_a_cut_line_passes_nothing_either_way() -> None:
    port, loop = faulty()
    port.arm("cut")
    port.send(0, b"abc")
    assert loop.traffic == b""
    assert received(port, loop, b"abc") == b""
    port.clear("cut")
    assert received(port, loop, b"abc") == b"abc"


def test_who_listens_is_told_what_was_sent_and_what_was_left_of_it() -> None:
    port, _ = faulty()
    heard = list[tuple[int, str, bytes, bytes]]()
    port.listeners.append(lambda *change: heard.append(change))
    port.arm("dup", "1")
    port.send(1, b"a")
    assert port.poll(2) == b"aaaa"
    port.arm("cut")
    port.send(3, b"b")
    port.send(4, b"")
    copy.deepcopy(port).send(5, b"c")
    port.clear("cut")
    port.clear("dup")
    port.send(6, b"d")
    assert heard == [(1, "<", b"a", b"aa"), (2, ">", b"aa", b"aaaa"), (3, "<", b"b", b"")]


@pytest.mark.parametrize(
    ("name", "expected"), [("flip", b"\x9e\x9d"), ("drop", b""), ("dup", b"aabb")]
)
def test_a_rate_of_1_hits_always(name: str, expected: bytes) -> None:
    port, loop = faulty()
    port.arm(name, "1")
    assert received(port, loop, b"ab") == expected


@pytest.mark.parametrize("name", ["flip", "drop", "dup"])
@given(data=st.binary(min_size=1, max_size=60), cut=st.integers(0, 60), seed=st.integers(0, 9))
def test_chunks_and_the_other_direction_make_no_difference(
    name: str, data: bytes, cut: int, seed: int
) -> None:
    port, loop = faulty(seed)
    port.arm(name, "0.3")
    whole = received(port, loop, data)
    port.arm(name, "0.3")
    port.send(0, b"something the other way")
    assert received(port, loop, data[:cut], b"", data[cut:]) == whole


def test_rates_are_probabilities() -> None:
    port, loop = faulty()
    port.arm("drop", "0.25")
    assert len(received(port, loop, bytes(100_000))) == pytest.approx(75_000, rel=0.01)
    port.clear("drop")
    port.arm("flip", "0.01")
    flipped = received(port, loop, bytes(100_000))
    assert sum(byte.bit_count() for byte in flipped) == pytest.approx(8_000, rel=0.05)


def test_seeds_and_faults_have_chances_of_their_own() -> None:
    outcomes = set()
    for seed in range(5):
        port, loop = faulty(seed)
        port.arm("drop", "0.5")
        outcomes.add(received(port, loop, bytes(range(64))))
    assert len(outcomes) == 5


def test_the_same_seed_gives_the_same_numbers_on_every_machine() -> None:
    chance = Chance(1, "flip >")
    assert [chance.draw() >> 32 for _ in range(3)] == [2019950067, 3854906882, 1538176888]
    assert threshold_of(1) == 2**64


@pytest.mark.parametrize(
    ("name", "rate", "error"),
    [
        ("flip", "0", "flip takes a rate above 0 and up to 1, as flip=0.01; got 0"),
        ("flip", "1.5", r"got 1\.5"),
        ("flip", "nan", "got nan"),
        ("cut", "0.5", "cut takes no argument, got 0.5"),
    ],
)
def test_a_rate_that_makes_no_sense_is_refused(name: str, rate: str, error: str) -> None:
    port, _ = faulty()
    with pytest.raises(ValueError, match=error):
        port.arm(name, rate)
    assert port.armed == ()


def test_faults_never_see_silence() -> None:
    port, loop = faulty()
    port.arm("drop", "0.5")
    before = received(port, loop, b"", b"abcdefgh")
    port.arm("drop", "0.5")
    assert received(port, loop, b"", b"", b"", b"abcdefgh") == before
    assert loop.due_us < NEVER


@given(
    st.lists(st.tuples(st.integers(0, 9_000), st.binary(min_size=1, max_size=9)), max_size=9),
    st.sampled_from(["flip=0.2", "drop=0.3", "dup=0.3"]),
)
def test_dense_and_sparse_runs_suffer_the_same(sent: list[tuple[int, bytes]], fault: str) -> None:
    def heard(*, dense: bool) -> list[tuple[int, bytes]]:
        line, spec = SerialLine(), parse_fault_spec(fault)
        port = FaultyPort(line.a, BYTE_FAULTS)
        port.arm(spec.name, *spec.arguments)
        rig, log = Rig(Station(Lamp(), port), dense=dense), []
        for delay_us, data in sent:
            line.b.send(rig.now_us, data)
            rig.run_for(delay_us)
            log.append((rig.now_us, line.b.poll(rig.now_us)))
        rig.run_for(50_000)
        return [*log, (rig.now_us, line.b.poll(rig.now_us))]

    assert heard(dense=False) == heard(dense=True)


SLOW: FaultForm = FaultForm(
    "answers late",
    arguments=(
        FaultArgument("delay", "how late", "800ms", "time", 1_000, 2_000_000),
        FaultArgument("code", "which code", "0x8110", high=0xFFFF),
        FaultArgument("way", "which way", "both", choices=("read", "write", "both")),
    ),
)


@pytest.mark.parametrize(
    ("words", "bound"),
    [
        ("", FaultArguments({"delay": 800_000, "code": 0x8110, "way": "both"})),
        ("1s", FaultArguments({"delay": 1_000_000, "code": 0x8110, "way": "both"})),
        ("1s,5,read", FaultArguments({"delay": 1_000_000, "code": 5, "way": "read"})),
        (
            "way=read,1s,rate=0.1,count=3",
            FaultArguments({"delay": 1_000_000, "code": 0x8110, "way": "read"}, 0.1, 3),
        ),
    ],
)
def test_arguments_are_bare_in_their_order_or_named(words: str, bound: FaultArguments) -> None:
    assert bind_arguments("slow", SLOW, words.split(",") if words else ()) == bound


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("3s", "slow: delay 3s is not in 1 ms to 2 s"),
        ("3", "slow: delay: '3' has no unit: write 3s, 3ms or 3us"),
        ("1s,x", "slow: code: 'x' is not a whole number"),
        ("1s,0x10000", "slow: code 0x10000 is not in 0 to 65535"),
        ("way=up", "slow: way 'up' is not read or write or both"),
        ("dealy=1s", "slow has no argument 'dealy'; did you mean 'delay'?"),
        ("1s,delay=2s", "slow has delay twice"),
        ("1s,2,read,4", r"'4' is one argument too many: slow\[=DELAY,CODE,WAY\]"),
        ("rate=2", "slow takes a rate above 0 and up to 1"),
        ("count=0", "count 0 is not in 1 to 1000000"),
        ("count=x", "count: 'x' is not a whole number"),
    ],
)
def test_an_argument_that_cannot_be_is_refused_by_name(words: str, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        bind_arguments("slow", SLOW, words.split(","))


def test_a_bare_name_acts_always_and_a_count_ends_it() -> None:
    port, loop = faulty()
    port.arm("drop")
    assert received(port, loop, b"abc") == b""
    assert port.acted("drop") == 3
    port.arm("drop", "count=2")
    assert received(port, loop, b"a", b"bcd") == b"cd"
    port.send(0, b"ef")  # both directions share the count
    assert (loop.traffic, port.acted("drop"), port.acted("dup")) == (b"ef", 2, 0)
    twin = copy.deepcopy(port)
    assert twin.acted("drop") == 2


def test_the_range_and_the_default_of_each_argument_can_be_read() -> None:
    ranges = {one.name: (one.default, one.range) for one in SLOW.all_arguments}
    assert ranges == {
        "delay": ("800ms", "1 ms to 2 s"),
        "code": ("0x8110", "0 to 65535"),
        "way": ("both", "read or write or both"),
        "rate": ("1", "above 0 to 1"),
        "count": ("always", "1 to 1000000"),
    }
    assert [each.name for each in BYTE_FAULTS["cut"].all_arguments] == ["way"]
    assert CAN_FAULTS["short"].all_arguments == ()


TABLES: dict[str, Mapping[str, FaultForm]] = {
    "Of a serial line": BYTE_FAULTS,
    "Of a CAN bus": CAN_FAULTS,
    "Of a CANopen node": NODE_FAULTS,
}


def table_of(faults: Mapping[str, FaultForm]) -> str:
    """Return the rows of a table of the page, made from the declarations."""
    rows = ["| fault | what it does | arguments |", "|---|---|---|"]
    for name, form in faults.items():
        arguments = "; ".join(
            f"`{one.name}`: {one.text}, {one.range} [{one.default}]" for one in form.arguments
        )
        usual = form.all_arguments[-2].default if form.rated else "1"
        arguments += f"rate [{usual}]" if usual != "1" else ""
        rows.append(f"| `{usage(name, form)}` | {form.text} | {arguments} |".replace("  ", " "))
    return "\n".join(rows)


def test_the_page_names_the_bus_faults_that_a_device_can_have() -> None:
    page = (Path(__file__).parents[3] / "docs/reference/bench/faults.md").read_text("utf-8")
    (line,) = re.findall(
        r"^If you set the fault (`drop`.*) for a device, it affects", page, re.MULTILINE
    )
    assert re.findall(r"`(\w+)`", line) == list(NARROWED)


@pytest.mark.parametrize("title", TABLES)
def test_the_page_has_the_table_of_the_declarations(title: str) -> None:
    page = (Path(__file__).parents[3] / "docs/reference/bench/faults.md").read_text("utf-8")
    assert table_of(TABLES[title]) in page.partition(f"## {title}\n")[2].partition("\n## ")[0]


def faults_anywhere() -> set[str]:
    """Return the faults of all lines, buses, nodes and devices of ours."""
    benches = map(Bench, [*DEVICES.built_in, *MODELS])
    physical = {name.rpartition("/")[2] for bench in benches for name in bench.describe().faults}
    return {*BYTE_FAULTS, *CAN_FAULTS, *NODE_FAULTS, *physical}


def test_each_synonym_suggests_a_fault_that_there_is() -> None:
    there = faults_anywhere()
    for faults, words in SYNONYMS:
        assert {*faults} <= there, faults
        for word in words.split():
            assert word not in faults
            for fault in faults:
                assert near_fault(word, ["x", fault]) == f"did you mean {fault!r}?"


@pytest.mark.parametrize(
    ("word", "fault"),
    [
        ("heartbeat_lost", "heartbeat_mute"),
        ("no_heartbeat", "heartbeat_mute"),
        ("node_lost", "power_off"),
        ("sdo_timeout", "sdo_mute"),
        ("bus_error", "corrupt"),
        ("Bus_Error", "corrupt"),
        ("power_cut", "power_off"),
        ("wheel_blocked", "shaft_blocked"),
        ("heartbeat_lat", "heartbeat_late"),
        ("shaft_stall", "shaft_blocked"),
        ("stall", "shaft_blocked"),
        ("jam", "shaft_blocked"),
        ("overcurrent", "short_circuit"),
    ],
)
def test_a_word_of_the_field_suggests_the_fault_of_a_drive(word: str, fault: str) -> None:
    with Bench("epos") as bench:
        with pytest.raises(ValueError, match=f"no fault '{word}'; did you mean '{fault}'"):
            bench.fault(word)
        with pytest.raises(ValueError, match=f"no fault '{word}'; did you mean '{fault}'"):
            bench.clear(word)


@pytest.mark.parametrize(
    ("word", "inputs"),
    [
        ("overheat", "'left/load_nm' or 'left/ambient_c'"),
        ("right/undervoltage", "'right/supply_v'"),
    ],
)
def test_a_word_of_the_field_suggests_the_inputs_that_cause_it(word: str, inputs: str) -> None:
    with Bench(left=make_epos(1), right=make_epos(2)) as bench:
        for call in (bench.fault, bench.clear):
            with pytest.raises(ValueError, match=f"no fault '{word}'; set the input {inputs}$"):
                call(word)
        with pytest.raises(ValueError, match=r"no fault 'hot' of left; set the input 'load_nm' or"):
            bench["left"].fault("hot")
    with (
        Bench("f-palette") as bench,
        pytest.raises(ValueError, match=r"no fault 'overheat'; known"),
    ):
        bench.fault("overheat")


def test_a_word_of_the_field_suggests_the_fault_of_the_first_device_or_of_the_one_named() -> None:
    names = ["left/power_off", "left/sdo_mute", "right/power_cut", "right/cut"]
    assert near_fault("no_power", names) == "did you mean 'left/power_off'?"
    assert near_fault("right/no_power", names) == "did you mean 'right/power_cut'?"
    assert near_fault("no_sync", names).startswith("known: left/power_off")
