"""Ports, timer, dead times, power, time-outs and limits of a node."""

from __future__ import annotations

from typing import Any

import pytest

from tests.device.rtc_lite.bench import NodeBench, Recorder
from tests.wire.rtc_lite.vectors import raw
from tickrig.device.physical import InputSignal
from tickrig.device.rtc_lite.component import LiteComponent, LiteEcho, LiteInPort, LiteOutPort
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_lite.codes import LiteContextType
from tickrig.wire.rtc_lite.frame import Checksum, Framing
from tickrig.wire.rtc_lite.values import BOOLEAN, LONG, LONG_SEQ, OCTET_SEQ

WRITE_42 = "PS\x02\x04in*\0\0\0"
DATA_42 = "QV\x03\x04out*\0\0\0"
TIMER = LiteConfig(context=LiteContextType.TIMER, rate_hz=100)


def timed(config: LiteConfig = TIMER) -> NodeBench:
    bench = NodeBench(config=config)
    bench.ask("CI")
    bench.recorder.called.clear()
    return bench


# Ports.


def test_a_new_value_overwrites_the_one_before() -> None:
    bench = NodeBench().enter("Active")
    bench.ask("PS\x02\x04in\x07\0\0\0")
    bench.ask(WRITE_42)
    assert bench.ask("AE") == f"{DATA_42} AE@A"


@pytest.mark.parametrize("state", ["Created", "Inactive", "Error", "None"])
def test_an_in_port_can_be_written_in_any_state(state: str) -> None:
    bench = NodeBench().enter(state)
    assert bench.ask(WRITE_42) == "PS@"
    assert bench.node.read("in.in") == 42


@pytest.mark.parametrize("size", [0, 3, 5, 56])
def test_a_value_of_another_size_is_refused_and_changes_nothing(size: int) -> None:
    bench = NodeBench().enter("Active")
    bench.ask(WRITE_42)
    assert bench.ask(f"PS\x02{chr(size)}in{'x' * size}") == "PS!"
    assert bench.ask("AE") == f"{DATA_42} AE@A"


def test_an_out_port_is_polled_once() -> None:
    bench = NodeBench().enter("Active")
    assert bench.ask("QG\x03out") == "QGI"
    assert bench.recorder.outlet.write(42)
    assert bench.ask("QG\x03out") == "QG@\x04*\0\0\0"
    assert bench.ask("QG\x03out") == "QGI"
    assert bench.ask("QG\x02in") == "QGD"


def test_data_go_before_the_reply_even_of_an_execution_that_failed() -> None:
    bench = NodeBench().enter("Active")
    bench.recorder.outlet.write(42)
    bench.recorder.failing.add("on_execute")
    assert bench.ask("AE") == f"{DATA_42} AExE"


def test_data_wait_while_nothing_is_executed() -> None:
    bench = NodeBench().enter("Inactive")
    bench.recorder.outlet.write(42)
    assert bench.ask("AE") == "AEHI"
    bench.ask("AA")
    assert bench.ask("AE") == f"{DATA_42} AE@A"


def test_a_value_that_a_sequence_has_no_room_for_is_not_written() -> None:
    port = LiteOutPort("out", OCTET_SEQ, 3)
    assert port.write((1, 2, 3))
    assert not port.write((1, 2, 3, 4))
    assert port.value == (1, 2, 3)


def test_a_sequence_takes_as_much_as_fits_into_a_frame() -> None:
    port = LiteInPort("in", OCTET_SEQ)
    assert port.accept(bytes(56))
    assert not port.accept(bytes(57))


def test_each_component_has_ports_of_its_own() -> None:
    first, second = Recorder(), Recorder()
    first.inlet.accept(b"\x2a\0\0\0")
    assert (first.inlet.value, second.inlet.value) == (42, 0)


# The timer of the device.


def test_the_timer_executes_at_its_rate_and_pushes_data() -> None:
    bench = timed()
    bench.ask("AA")
    bench.ask(WRITE_42)
    assert bench.run(8_000) == b""
    assert bench.push() == raw("0A 51 56 03 04 6F 75 74 2A 00 00 00 30")
    assert bench.run(30_000) == b""
    assert bench.recorder.called == ["on_activated", *["on_execute"] * 4]


def test_an_error_of_the_timer_is_seen_by_asking_and_on_error_runs() -> None:
    bench = timed()
    bench.ask("AA")
    bench.recorder.failing.add("on_execute")
    assert bench.run(20_000) == b""
    assert bench.ask("CX") == "CX@E"
    called = "on_activated on_execute on_deactivated on_aborting on_error"
    assert bench.recorder.called == called.split()


@pytest.mark.parametrize("command", ["AE", "AC"])
def test_the_proxy_may_not_execute_what_a_timer_executes(command: str) -> None:
    assert timed().ask(command) == f"{command}!"


def test_the_type_of_the_execution_context_is_told() -> None:
    assert timed().ask("BB") == 'BB@"'


@pytest.mark.parametrize(("rate_hz", "executions"), [(1, 1), (3, 3), (300, 300), (1_000, 1_000)])
def test_a_rate_holds_over_a_second(rate_hz: int, executions: int) -> None:
    bench = timed(LiteConfig(context=LiteContextType.TIMER))
    assert bench.ask(f"BW{chr(rate_hz & 0xFF)}{chr(rate_hz >> 8)}") == "BW@"
    bench.ask("AA")
    bench.run(1_000_000)
    assert bench.node.read("executed") == executions


def test_a_new_rate_starts_the_period_again() -> None:
    bench = timed()
    bench.ask("AA")
    bench.run(9_000)
    bench.ask("BW\x32\0")
    bench.run(19_000)
    assert bench.node.read("executed") == 0
    bench.push()
    assert bench.node.read("executed") == 1


@pytest.mark.parametrize("rate", ["\0\0", "\xe9\x03"])
def test_a_rate_that_the_timer_cannot_hold_is_refused(rate: str) -> None:
    assert timed().ask(f"BW{rate}") == "BW!"


def test_a_rate_is_refused_where_the_proxy_executes() -> None:
    assert NodeBench().enter("Inactive").ask("BW\x0a\0") == "BW!"


# Dead times.


def test_a_callback_that_takes_time_delays_its_answer() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("callback_ms", 30)
    assert bench.ask("AE") == ""
    assert bench.run(29_000) == b""
    assert bench.push() == raw("0A 41 45 40 41 07")
    assert bench.ask("CY\x01") == "CY@\x01"


def test_a_callback_takes_at_most_10_s() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("callback_ms", 10_000)
    with pytest.raises(ValueError, match="callback_ms"):
        bench.node.inputs.set("callback_ms", 10_001)


def test_each_callback_of_an_abort_takes_its_time() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("callback_ms", 30)
    bench.ask("AB")
    assert bench.run(59_000) == b""
    assert bench.push() == raw("0A 41 42 40 45 08")


def test_requests_to_a_busy_node_wait_in_its_buffer() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("callback_ms", 30)
    bench.push(raw("0A 41 45 86"))
    bench.push(raw("0A 43 59 01 9D", "0A 41 44 85"))
    assert bench.run(28_000) == b""
    assert bench.push() == raw("0A 41 45 40 41 07")
    assert bench.run(29_000) == b""
    assert bench.push() == raw("0A 43 59 40 01 DD", "0A 41 44 40 49 0E")
    assert bench.node.read("dropped_bytes") == 0


def test_what_a_full_buffer_has_no_room_for_is_lost() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("callback_ms", 30)
    bench.push(raw("0A 41 45 86"))
    bench.push(raw("0A 43 59 01 9D") * 13)
    assert bench.node.read("dropped_bytes") == 1
    assert bench.run(28_000) == b""
    assert bench.push() == raw("0A 41 45 40 41 07", *["0A 43 59 40 01 DD"] * 12)
    assert bench.run(200_000) == raw("0A 46 4B 01 92")  # the 13th was broken off


def test_a_slow_processor_is_late_with_every_answer() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("slow_answer", 1)
    assert bench.ask("CY\x01") == ""
    assert bench.run(199_000) == b""
    assert bench.push() == raw("0A 43 59 40 01 DD")


def test_a_timer_that_is_late_leaves_periods_out() -> None:
    bench = timed()
    bench.ask("AA")
    bench.node.inputs.set("callback_ms", 25)
    bench.run(100_000)
    assert bench.recorder.called == ["on_activated", *["on_execute"] * 4]  # at 10, 35, 60 and 85 ms


# Time-outs.


def test_a_frame_in_pieces_with_pauses_below_100_ms_is_whole() -> None:
    bench = NodeBench().enter("Active")
    for piece in ("0A", "43", "59", "01"):
        assert bench.push(raw(piece)) + bench.run(98_000) == b""
    assert bench.push(raw("9D")) == raw("0A 43 59 40 01 DD")


def test_the_byte_that_comes_after_a_pause_of_100_ms_is_not_of_the_frame() -> None:
    bench = NodeBench().enter("Active")
    bench.push(raw("0A 43 59"))
    assert bench.run(99_000) == b""
    assert bench.push(raw("01 0A 43 59 01 9D")) == raw("0A 46 4B 01 92", "0A 43 59 40 01 DD")


def test_after_an_unknown_frame_20_ms_of_silence_are_needed() -> None:
    bench = NodeBench().enter("Active")
    bench.push(raw("0A 5A 7A D4"))
    for _ in range(3):
        bench.run(18_000)
        assert bench.ask("CY\x01") == ""
    bench.run(19_000)
    assert bench.ask("CY\x01") == "CY@\x01"


def test_that_a_line_was_silent_takes_no_time_of_a_callback() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("callback_ms", 30)
    bench.push(raw("0A 43 59"))
    bench.run(99_000)
    assert bench.push() == raw("0A 46 4B 01 92")


# When it is due.


def test_a_node_is_due_at_once_when_it_begins_is_reset_or_an_input_is_set() -> None:
    bench = NodeBench()
    assert bench.node.due_us == 0
    bench.push()
    assert bench.node.due_us == NEVER
    bench.node.inputs.set("callback_ms", 1)
    assert bench.node.due_us == 0
    bench.push()
    bench.node.reset()
    assert bench.node.due_us == 0


# Power.


def test_a_power_cut_forgets_everything() -> None:
    bench = NodeBench().enter("Active")
    bench.ask(WRITE_42)
    bench.push(raw("0A 43"))
    bench.node.inputs.set("power_cut", 1)
    assert bench.ask("CX") == ""
    assert (bench.state, bench.node.due_us) == ("Off", NEVER)
    assert bench.run(200_000) == b""
    bench.node.inputs.set("power_cut", 0)
    assert bench.ask("CX") == "CX@C"
    assert bench.node.read("in.in") == 0


def test_a_power_cut_while_an_answer_waits_takes_it_away() -> None:
    bench = NodeBench().enter("Active")
    bench.node.inputs.set("callback_ms", 30)
    bench.ask("AE")
    bench.node.inputs.set("power_cut", 1)
    bench.push()
    bench.node.inputs.set("power_cut", 0)
    assert bench.run(100_000) == b""


def test_a_power_cut_makes_a_new_component() -> None:
    bench = NodeBench()
    before = bench.recorder
    bench.node.reset()
    assert bench.recorder is not before


# Bridge mode, checksum, physical inputs.


def test_a_node_of_rtno_initializes_at_power_up_and_speaks_packets() -> None:
    bench = NodeBench(config=LiteConfig(Framing.RTNO))
    assert bench.say("0A 0A 58 00 58") == "0A 0A 58 01 49 A2"
    assert bench.recorder.called == ["on_initialize"]
    assert bench.say("0A 0A 41 00 41") == "0A 0A 41 01 40 82"
    assert bench.say("0A 0A 53 08 02 04 69 6E 2A 00 00 00 62") == "0A 0A 53 01 40 94"
    data, reply = "0A 0A 56 09 03 04 6F 75 74 2A 00 00 00 E8", "0A 0A 45 01 40 86"
    assert bench.say("0A 0A 45 00 45") == f"{data} {reply}"
    assert bench.say("0A 0A 45 00 46") == "0A 0A 46 01 FD 44"


def test_parity_instead_of_a_sum() -> None:
    bench = NodeBench(config=LiteConfig(checksum=Checksum.XOR8))
    assert bench.say("0A 43 58 1B") == "0A 43 58 40 43 18"
    assert bench.say("0A 43 58 9B") == "0A 46 48 03 0D"


class Thermometer(LiteComponent):
    type_name = "Thermo"
    physical = (InputSignal("temperature_dc", "temperature", low=-400, high=1_250),)
    temperature = LiteOutPort("t", LONG)
    warm = LiteOutPort("warm", BOOLEAN)
    history = LiteOutPort("history", LONG_SEQ, 4)

    def on_execute(self) -> None:
        now_dc = self.inputs["temperature_dc"]
        self.temperature.write(now_dc)
        self.warm.write(now_dc > 200)
        self.history.write((*self.history.value, now_dc)[-4:])


def test_a_component_reads_the_physical_inputs_that_it_declares() -> None:
    bench = NodeBench(Thermometer)
    bench.node.inputs.set("temperature_dc", 215)
    for request in ("CI", "AA", "AE"):
        bench.ask(request)
    assert bench.node.read("out.t") == 215
    assert bench.node.read("out.warm") == 1
    assert bench.node.read("out.history") == "215"
    assert list(bench.node.outputs)[-3:] == ["out.t", "out.warm", "out.history"]


# What a PIC has no room for.


def component(**attributes: Any) -> type[LiteComponent]:
    return type("Mine", (LiteComponent,), {"type_name": "Mine", **attributes})


@pytest.mark.parametrize(
    ("attributes", "error"),
    [
        ({"type_name": ""}, "Mine: type_name: name '' has 0 characters, 1..15 fit"),
        ({"type_name": "x" * 16}, "Mine: type_name: name 'x*' has 16 characters, 1..15 fit"),
        (
            {"a": LiteInPort("in", LONG), "b": LiteInPort("in", LONG)},
            "Mine: 2 in-ports are called 'in'",
        ),
        (
            {f"p{n}": LiteOutPort(f"p{n}", LONG) for n in range(9)},
            "Mine: 9 out-ports, at most 8 fit",
        ),
        (
            {"physical": (InputSignal("power_cut", ""),)},
            "Mine: two inputs are called 'power_cut'",
        ),
        (
            {"physical": (InputSignal("volt", "", real=True),)},
            "Mine: input 'volt' takes fractions; give it a finer unit",
        ),
        (
            {"physical": (InputSignal("light", ""), InputSignal("light", ""))},
            "Mine: two inputs are called 'light'",
        ),
    ],
)
def test_a_component_that_does_not_fit_is_refused(attributes: dict[str, Any], error: str) -> None:
    with pytest.raises(ValueError, match=error):
        RtcLiteNode(component(**attributes))


def test_an_in_port_and_an_out_port_may_share_a_name() -> None:
    assert component(a=LiteInPort("x", LONG), b=LiteOutPort("x", LONG))().in_ports.keys() == {b"x"}


@pytest.mark.parametrize(
    ("name", "most", "error"),
    [
        ("x" * 16, None, "has 16 characters, 1..15 fit"),
        ("in", 15, "port in: 15 elements of TimedLongSeq, 1..14 fit"),
        ("in", 0, "port in: 0 elements of TimedLongSeq, 1..14 fit"),
    ],
)
def test_a_port_that_does_not_fit_is_refused(name: str, most: int | None, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        LiteInPort(name, LONG_SEQ, most)


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        ({"rate_hz": 0}, "rate_hz is 0, 1..1000 is possible"),
        ({"rate_hz": 1_001}, "rate_hz is 1001"),
        ({"slow_answer_us": 0}, "slow_answer_us is 0, at least 1 is needed"),
        (
            {"framing": Framing.RTNO, "checksum": Checksum.XOR8},
            "checksum is xor8, packets of RTno have sum8",
        ),
    ],
)
def test_a_configuration_that_no_node_has_is_refused(settings: dict[str, Any], error: str) -> None:
    with pytest.raises(ValueError, match=error):
        LiteConfig(**settings)


def test_what_happened_to_it_is_due_in_the_next_millisecond() -> None:
    bench = NodeBench()
    assert bench.node.tick_us == 1_000
    bench.ask("CI")
    assert bench.node.due_us > bench.now_us
    bench.node.inputs.set("power_cut", 1)
    assert bench.node.due_us == 0


def test_a_node_that_computes_is_due_when_it_is_free_again() -> None:
    bench = NodeBench()
    bench.node.inputs.set("callback_ms", 30)
    bench.ask("CI")
    assert bench.node.due_us == bench.now_us + 30_000


def test_the_echo_hands_on_what_is_new() -> None:
    bench = NodeBench(LiteEcho)
    bench.ask("CI")
    bench.ask("AA")
    bench.ask(WRITE_42)
    assert bench.ask("AE") == f"{DATA_42} AE@A"
    assert bench.ask("AE") == "AE@A"
