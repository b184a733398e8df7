from __future__ import annotations

import pytest

from tests.host.canmon.model.check.expression.held import MAPPED, broken, findings
from tickrig.host.canmon.model.check.rule import CheckedTraffic
from tickrig.host.canmon.model.check.rule_parser import parse_rule
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame, FdFrame

FAULT = "3.statusword.fault never"
ENABLED, FAULTY = "183#370264000000", "183#3F0264000000"
FAR = "183#3702E8030000"
SAID = "tpdo1 of node 3: statusword=0x023F[fault reaction active] position_actual_value=100"


def test_a_bit_that_is_never_set_is_told_each_time_it_is() -> None:
    text = f"1 {ENABLED}\n2 {FAULTY}\n3 {FAULTY}\n4 {ENABLED}\n5 {FAULTY}"
    assert broken(FAULT, MAPPED + text) == [f"2 {SAID}", f"5 {SAID}"]


@pytest.mark.parametrize(
    "rule",
    [
        "3.statusword.3 never",
        "statusword.fault of 3 never",
        "3.statusword.fault = 0 always",
        "3.statusword.fault in {0}",
        "3.statusword in {237h}",
        "tpdo1 of 3 and statusword.fault never",
    ],
)
def test_a_bit_is_written_in_several_ways(rule: str) -> None:
    found = broken(rule, MAPPED + f"1 {ENABLED}\n2 {FAULTY}\n3 {FAULTY}")
    assert [line[: len(SAID) + 2] for line in found] == [f"2 {SAID}"]


def test_a_bit_that_is_always_set_is_told_when_it_is_not() -> None:
    rule = "3.statusword.operation_enabled always"
    found = broken(rule, MAPPED + f"1 {ENABLED}\n2 183#330200000000\n3 183#330200000000")
    assert [line.partition(":")[0] for line in found] == ["2 tpdo1 of node 3"]


@pytest.mark.parametrize("values", ["-500..500", "..500", "{0, 100}", "{0..100, 700}"])
def test_a_value_out_of_range_is_found(values: str) -> None:
    rule = f"3.position_actual_value in {values}"
    assert broken(rule, MAPPED + f"1 {ENABLED}\n2 {FAR}\n3 {FAR}") == [
        "2 tpdo1 of node 3: statusword=0x0237[operation enabled] position_actual_value=1000;"
        f" {rule} is right"
    ]


def test_an_emcy_of_another_code_is_found_and_its_end_is_not() -> None:
    text = "1 085#3081110000000000\n2 085#1081110000000000\n3 085#0000000000000000"
    found = broken("emcy of 5 in {8130h}", text)
    assert [line[:29] for line in found] == ["2 emcy of node 5: 8110h CAN o"]
    assert len(broken("emcy of 5 in {8100h..81FFh}", text)) == 0
    assert len(broken("emcy of 5 in {0}", text)) == 2
    assert len(broken("emcy of 4 in {0}", text)) == 0


def test_a_kind_has_the_values_that_its_text_names() -> None:
    text = "1 703#05\n2 703#7F\n3 703#04"
    assert broken("heartbeat of 3 in {operational, pre-operational}", text) == [
        "3 heartbeat of node 3: stopped; heartbeat of 3 in {operational, pre-operational} is right"
    ]


def test_a_counter_that_skips_or_stands_is_found() -> None:
    text = "1 080#01\n2 080#02\n3 080#03\n4 080#01\n5 080#02\n6 080#02\n7 080#04\n8 080#01"
    assert broken("sync counts", text) == [
        "6 counter is 2 after 2, one more is right",
        "7 counter is 4 after 2, one more is right",
    ]
    assert broken("sync counts", "1 080#02\n2 080#03\n3 080#01\n4 080#02\n5 080#01") == [
        "5 counter is 1 after 2, one more is right"
    ]


def test_a_counter_begins_anew_after_a_boot_up() -> None:
    text = MAPPED + "1 183#370205000000\n2 703#00\n" + MAPPED + "3 183#370200000000"
    assert broken("3.position_actual_value counts", text) == []


def test_a_value_that_jumps_is_found() -> None:
    assert broken("3.position_actual_value steps under 100", MAPPED + f"1 {ENABLED}\n2 {FAR}") == [
        "2 position_actual_value is 1000 after 100, a step of 100 is right"
    ]


def test_a_value_that_does_not_change_is_found_once() -> None:
    rule = "3.position_actual_value changes within 1s"
    text = f"1 {ENABLED}\n2 {ENABLED}\n2.1 {ENABLED}\n3 {ENABLED}\n4 {FAR}\n4.5 {FAR}"
    assert broken(rule, MAPPED + text) == [
        "2.1 position_actual_value=100 has not changed for 1100.0 ms, at most 1000.0 is right"
    ]


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ("3.statsword.fault never", "no signal 3.statsword.fault came; did you mean statusword?"),
        ("emyc never", "no signal emyc came; did you mean emcy?"),
        ("4.statusword.fault never", "no signal 4.statusword.fault came"),
        ("3.speed in 0..5", "no signal 3.speed came"),
        ("kind=qqq never", "no frame with kind=qqq came"),
        ("node 4 stopped never", "no signal state of node 4 came"),
    ],
)
def test_a_rule_whose_signal_never_came_does_not_hold(rule: str, said: str) -> None:
    found = broken(rule, MAPPED + f"1 {ENABLED}")
    assert found == [f"1 {said}"]


UNMAPPED = "unmapped of node 1: mapping unknown "


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ("181[2:4] in ..500", f"{UNMAPPED}181[2:4]=1000; 181[2:4] in ..500 is right"),
        ("181[2:4]s*0.01 > 9.5 never", f"{UNMAPPED}181[2:4]s*0.01=10"),
        ("181[0.3] never", f"{UNMAPPED}181[0.3]=1"),
        ("181 and 181[0.3] = 1 never", f"{UNMAPPED}181[0.3]=1"),
        ("181[2:4] steps under 100", "181[2:4] is 1000 after 100, a step of 100 is right"),
        ("not (181[2:4]+5 < 1000) and 181 never", f"{UNMAPPED}181[2:4]+5=1005"),
    ],
)
def test_bits_of_frames_that_nobody_mapped_are_values(rule: str, said: str) -> None:
    text = "1 181#00006400\n2 181#0800E803\n3 182#FFFFFFFF\n4 181#08"
    assert broken(rule, text) == [f"2 {said}"]


def test_a_slice_of_29_bits_is_another_one() -> None:
    assert len(broken("18FF0001[0] in 0..1", "1 18FF0001#02\n2 181#02")) == 1
    assert broken("00000181[0] in 0..1", "1 181#02") == ["1 no signal 00000181[0] came"]


def test_forbidden_bits_of_a_frame_that_never_came_are_not_judged() -> None:
    assert broken("182[0.3] never", "1 181#02") == []
    (rule,) = parse_rule("182[0.3] never").make()
    other = Record(1_000_000, "can0", CanFrame.parse("181#02"))
    assert rule.take(other, Decoder().take(other)) is None
    said = rule.unjudged(CheckedTraffic({}, 2_000_000, ""))
    assert said.startswith("nothing with 182[0.3] came while it was in force")
    found = broken("182[0.3] never", "1 182#08\n2 182#00")
    assert found == ["1 unmapped of node 2: mapping unknown 182[0.3]=1"]
    assert len(broken("182[0.3] never while statsword.fault", "1 181#02")) == 1


def test_a_log_without_frames_is_the_reason_why_a_rule_judges_nothing() -> None:
    (rule,) = parse_rule("emcy never").make()
    assert rule.unjudged(CheckedTraffic({}, 0, "")) == "no frame came"


HINT = "; PDOs without a known mapping came: describe them by --eds"


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ("tpdo1 of 3 every 10ms ±10%", "tpdo1 of 3 never came"),
        ("tpdo1 of 3 at least 2", "tpdo1 of 3 came 0 times, at least 2 is right"),
        ("3.statusword.fault never", "no signal 3.statusword.fault came"),
    ],
)
def test_it_is_told_that_a_pdo_has_no_name_without_its_mapping(rule: str, said: str) -> None:
    text = f"1 {ENABLED}\n1.5 183#"
    assert broken(rule, text) == [f"1.5 {said}{HINT}"]
    assert not any(HINT in line for line in broken(rule, f"{MAPPED}{text}\n2 281#"))
    assert not any(HINT in line for line in broken(rule, "1 703#05"))


def test_all_bytes_of_a_can_fd_frame_are_values() -> None:
    frames = (FdFrame.parse(f"181##1{data * 12}") for data in ("01", "02"))
    records = [Record(at_us, "can0", frame) for at_us, frame in enumerate(frames, 1)]
    (found,) = findings("181[11] in {1}", records)
    assert found.text == "fd: no CANopen service 181[11]=2; 181[11] in {1} is right"


@pytest.mark.parametrize(
    ("rule", "right", "wrong"),
    [
        ("nmt in {start}", "000#0105", "000#0205"),
        ("nmt in {stop, 0x81}", "000#0205\n2 000#8105", "000#0105"),
        ("nmt in {enter-pre-operational, reset-communication}", "000#8000", "000#8100"),
        ("nmt in {1}", "000#0105", "000#0205"),
        ("command = start never", "000#0205", "000#0105"),
        ("lss in {configure-node-id}", "7E5#1105000000000000", "7E5#1305000000000000"),
        ("error in {no-acknowledge}", "20000020#0000000000000000", "20000004#0020000000000000"),
        ("heartbeat in {operational}", "703#05", "703#04"),
        ("guard in {stopped}", "703#84", "703#85"),
    ],
)
def test_a_kind_has_its_values_by_name_and_by_number(rule: str, right: str, wrong: str) -> None:
    assert broken(rule, f"1 {right}") == []
    assert len(broken(rule, f"1 {wrong}")) == 1
