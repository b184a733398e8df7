"""Ports of a DeviceRTC: objects, PDOs, and what is new (DECISION K2 to K5)."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.device.canopen.device_rtc.bench import Recorder, RtcBench
from tests.device.canopen.device_rtc.test_life_cycle import GOLDEN
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.device_rtc import (
    CanopenComponent,
    CanopenEcho,
    CanopenInPort,
    CanopenOutPort,
    DeviceRtc,
    make_device_rtc,
)
from tickrig.device.physical import InputSignal
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_canopen import (
    BOOLEAN,
    CHARACTER,
    DOUBLE,
    LONG,
    SHORT,
    STRING,
    WIDE_CHARACTER,
    WIDE_STRING,
    PortTransport,
)


class Everything(CanopenComponent):
    """Four ports each way, of several types and lengths."""

    type_name = "Everything"
    version = "2.3"
    rate_hz = 1_000
    in1 = CanopenInPort("in1", LONG)
    in2 = CanopenInPort("in2", SHORT.sequence(3))
    in3 = CanopenInPort("in3", BOOLEAN)
    in4 = CanopenInPort("in4", CHARACTER.sequence(2))
    out1 = CanopenOutPort("out1", LONG)
    out2 = CanopenOutPort("out2", SHORT.sequence(3))
    out3 = CanopenOutPort("out3", BOOLEAN)
    out4 = CanopenOutPort("out4", DOUBLE)

    def on_execute(self) -> None:
        if self.in1.is_new:
            self.out1.write(self.in1.read())
        if self.in2.is_new:
            self.out2.write(self.in2.read())
        if self.in3.is_new:
            self.out3.write(self.in3.read())


def active(kind: type[CanopenComponent], first: str = "000#0110") -> Bus:
    bus = Bus(make_device_rtc(kind, 16))
    bus.step()
    bus.step(first)
    return bus


def test_each_port_has_the_pdo_of_its_pair() -> None:
    pairs = json.loads(GOLDEN.read_text("utf-8"))["pdo_pairs"]
    dictionary = make_device_rtc(Everything, 16).dictionary
    for place in Everything.profile().placed():
        sends = place.profile.direction.value == "out"
        parameter = (0x1800 if sends else 0x1400) + place.number - 1
        (pair,) = (
            row
            for row in pairs
            if f"{parameter:04X}h" in (row.get("device_tpdo"), row.get("device_rpdo"))
        )
        cob_id = int(pair["cob"].split("h+")[0], 16)
        assert dictionary[parameter, 1].number == cob_id == place.cob_id
        assert pair["map"].startswith(f"{parameter + 0x200:04X}h")
        count = dictionary[parameter + 0x200, 0].number
        mapped = dictionary.elements(parameter + 0x200)[:count]
        assert tuple(entry.number for entry in mapped) == place.mapping


def test_ports_are_objects_from_2100h_up_in_order_of_declaration() -> None:
    dictionary = make_device_rtc(Everything, 16).dictionary
    ports = {index: info.name for index, info in dictionary.objects.items() if index >= 0x2100}
    assert list(ports) == list(range(0x2100, 0x2108))
    assert " ".join(ports.values()) == "in1 in2 in3 in4 out1 out2 out3 out4"


def test_identity_and_heartbeat_are_those_of_the_profile() -> None:
    dictionary = make_device_rtc(Everything, 16).dictionary
    assert dictionary[0x1000, 0].number == 0
    assert dictionary[0x1008, 0].value == "Everything"
    assert dictionary[0x100A, 0].value == "2.3"
    assert dictionary[0x1017, 0].number == 100
    assert [dictionary[0x1018, sub].number for sub in (1, 3)] == [0, 0x2_0003]
    assert dictionary[0x1018, 2].number == 0x4A1FF687  # CRC-32 of "Everything"


@pytest.mark.parametrize(
    ("received", "sent"),
    [
        ("210#FEFFFFFF", "190#FEFFFFFF"),
        ("310#0100FFFF0080", "290#0100FFFF0080"),
        ("410#01", "390#01"),
        ("410#FE", "390#00"),  # dummies fill up the byte of a Boolean
    ],
)
def test_what_an_in_port_gets_the_component_has_in_its_next_period(
    received: str, sent: str
) -> None:
    bus = active(Everything)
    bus.step()
    assert bus.step(received) == [sent]


class Wide(CanopenComponent):
    """What needs more than whole bytes of the first four PDOs; all of it is sent back."""

    type_name = "Wide"
    rate_hz = 1_000
    flags = CanopenInPort("flags", BOOLEAN.sequence(10))
    word = CanopenInPort("word", WIDE_CHARACTER.sequence(3))
    label = CanopenInPort("label", STRING)
    path = CanopenInPort("path", DOUBLE.sequence(2))
    flags_out = CanopenOutPort("flags_out", BOOLEAN.sequence(10))
    word_out = CanopenOutPort("word_out", WIDE_CHARACTER.sequence(3))
    label_out = CanopenOutPort("label_out", WIDE_STRING)
    path_out = CanopenOutPort("path_out", DOUBLE.sequence(2))
    slow = CanopenOutPort("slow", SHORT, transport=PortTransport.SDO)
    third = CanopenOutPort("third", SHORT)
    fourth = CanopenOutPort("fourth", SHORT)
    fifth = CanopenOutPort("fifth", SHORT, cob_id=0x2A5)
    sixth = CanopenOutPort("sixth", SHORT)

    def on_execute(self) -> None:
        pairs: tuple[tuple[CanopenInPort[Any], CanopenOutPort[Any]], ...] = (
            *((self.flags, self.flags_out), (self.word, self.word_out)),
            *((self.label, self.label_out), (self.path, self.path_out)),
        )
        for inlet, outlet in pairs:
            if inlet.is_new:
                outlet.write(inlet.read())
                self.slow.write(self.slow.value + 1)
                self.fifth.write(self.slow.value)


@pytest.mark.parametrize(
    ("received", "sent"),
    [
        ("210#FFFD", "190#FF01"),
        ("210#0102", "190#0102"),
        ("310#2B734100FFFF", "290#2B734100FFFF"),
    ],
)
def test_bits_and_wide_characters_lie_in_pdos_as_table_4_has_them(received: str, sent: str) -> None:
    bus = active(Wide)
    bus.step()
    assert bus.step(received) == [sent, "2A5#0100"]


def test_a_fifth_pdo_is_sent_with_the_cob_id_that_was_named_and_one_without_is_off() -> None:
    bus = Bus(make_device_rtc(Wide, 16))
    bus.step()
    sent = bus.step("000#0110")
    assert {text.partition("#")[0] for text in sent} == {"190", "290", "390", "490", "2A5"}
    assert bus.slave.dictionary[0x1805, 1].number == 0x8000_0000


def test_activation_sends_every_out_port_once() -> None:
    bus = Bus(make_device_rtc(Everything, 16))
    bus.step()
    assert bus.step("000#0110") == [
        *("190#00000000", "290#000000000000", "390#00", "490#0000000000000000"),
    ]


def test_a_value_that_is_written_again_is_sent_again() -> None:
    bus = active(Everything)
    assert [bus.step("210#01000000") for _ in range(2)] == [["190#01000000"]] * 2


def test_an_in_port_is_new_by_sdo_too() -> None:
    bus = active(Everything)
    assert bus.step("610#2300210005000000") == ["190#05000000", "590#6000210000000000"]


def test_an_in_port_that_was_read_is_not_new() -> None:
    bus = active(CanopenEcho)
    assert bus.step("210#01000000") + bus.run(30) == ["190#01000000"]


def test_rpdos_of_a_component_that_is_not_active_reach_no_port() -> None:
    bench = RtcBench().enter("Inactive")
    bench.step("210#2A00")
    assert bench.rtc.read("in.inlet") == 0


@pytest.mark.parametrize(("value", "reason"), [(40_000, "40000 is no INTEGER16"), ("x", "'x' is")])
def test_a_value_that_an_out_port_cannot_have_is_the_components_mistake(
    value: int, reason: str
) -> None:
    bench = RtcBench().enter("Active")
    component = bench.rtc.life.component
    assert isinstance(component, Recorder)
    with pytest.raises(FieldError, match=reason):
        component.outlet.write(value)


def test_outputs_show_state_callback_and_ports() -> None:
    bus = active(Everything)
    bus.step("310#0100FFFF0080", "510#4142", "410#01")
    rtc = DeviceRtc.of(bus.slave)
    shown = {name: rtc.read(name) for name in rtc.outputs}
    assert (shown["rtc_state"], shown["callback"], shown["executed"]) == ("Active", "on_execute", 1)
    assert (shown["in.in2"], shown["in.in3"], shown["in.in4"]) == ("1 -1 -32768", 1, "A B")
    with pytest.raises(KeyError):
        rtc.read("in.nothing")


@pytest.mark.parametrize("rate_hz", [1, 3, 100, 300, 1_000])
def test_a_component_runs_at_its_rate_without_drift(rate_hz: int) -> None:
    class Timed(Recorder):
        pass

    Timed.rate_hz = rate_hz
    bench = RtcBench(kind=Timed).enter("Active")
    bench.run(2_000)
    assert bench.called.count("on_execute") == 2 * rate_hz


def test_a_component_reads_the_physical_inputs_that_it_declares() -> None:
    class Scale(CanopenEcho):
        physical = (InputSignal("weight_g", "on the scale", high=5_000, unit="g"),)

        def on_execute(self) -> None:
            self.outlet.write(int(self.inputs["weight_g"]))

    bus = active(Scale)
    DeviceRtc.of(bus.slave).inputs.set("weight_g", 300)
    assert bus.run(10) == ["190#2C010000"]


def test_two_inputs_of_one_name_are_refused() -> None:
    class Twice(CanopenEcho):
        physical = (InputSignal("shut_down", "mine"),)

    with pytest.raises(ValueError, match="Twice: 2 inputs are called 'shut_down'"):
        make_device_rtc(Twice, 16)


def test_a_component_without_a_name_is_refused() -> None:
    with pytest.raises(ValueError, match="Component: type_name '' is not a letter and up to 31"):
        make_device_rtc(CanopenComponent, 16)
