from __future__ import annotations

from itertools import pairwise
from math import pi

import pytest

from tests.device.urg.measured import Measured
from tickrig.device.urg.sensor import INPUTS, OUTPUTS, Urg
from tickrig.device.urg.world import Post, UrgParameters, Wall, World, room
from tickrig.wire.instant import NEVER
from tickrig.wire.scip import Reply, parse_number, parse_scan
from tickrig.wire.uart import UartSetting

AHEAD = World((Wall(2, -10, 2, 10),))
"""A wall 2 m in front of the origin."""

FRONT = "0384038401"


@pytest.mark.parametrize(
    ("line", "lines"),
    [
        ("VV", 5),
        ("PP", 8),
        ("II", 7),
    ],
)
def test_it_tells_of_itself(line: str, lines: int) -> None:
    (reply,) = Measured().replies(1, line.encode() + b"\n")
    assert (reply.status, len(reply.lines)) == ("00", lines)


def test_it_tells_what_a_real_sensor_told() -> None:
    measured = Measured()
    assert measured.run(1, b"VV\n") == (
        b"VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROD:SOKUIKI Sensor URG-04LX;[\n"
        b"FIRM:3.1.00(18/Jan./2007);`\nPROT:SCIP 2.0;N\nSERI:H0614967;V\n\n"
    )
    assert measured.run(1, b"PP\n") == (
        b"PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\n"
        b"ARES:1024;\\\nAMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n"
    )


def test_its_state_follows_what_was_set() -> None:
    measured = Measured()
    (reply,) = measured.replies(0x1234, b"II\n")
    assert b"LASR:OFF;7" in reply.lines
    assert b"SCSP:Initial(600[rpm])<-Default setting by user;A" in reply.lines
    assert b"MESM:IDLE;:" in reply.lines
    assert b"SBPS:19200[bps]<-Default setting by user;A" in reply.lines
    for line in ("CR05", "SS115200", "HS1", "BM"):
        assert measured.ask(line) == "00"
    (reply,) = measured.replies(1, b"II\n")
    texts = [line.rpartition(b";")[0] for line in reply.lines[1:]]
    assert texts == [
        b"LASR:ON",
        b"SCSP:570[rpm]",
        b"MESM:Measuring by Sensitive Mode",
        b"SBPS:115200[bps]",
        b"TIME:001239",
        b"STAT:Sensor works well.",
    ]


@pytest.mark.parametrize("end", [b"\n", b"\r", b"\r\n"])
def test_a_command_ends_with_lf_or_cr_or_both(end: bytes) -> None:
    assert Measured().run(5, b"QT" + end) == b"QT\n00P\n\n"


def test_commands_come_in_pieces() -> None:
    measured = Measured()
    assert measured.run(1, b"Q") + measured.run(1, b"T;a") + measured.run(1, b"b\nQ") == (
        b"QT;ab\n00P\n\n"
    )


def test_the_string_comes_back() -> None:
    assert Measured().run(1, b"BM;left 1.0_+@\n") == b"BM;left 1.0_+@\n00P\n\n"


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("XX", "0E"),
        ("SCIP2.0", "0E"),
        ("TM", "0C"),
        ("VV1", "0D"),
        ("QT;12345678901234567", "0G"),
        ("QT;a-b", "0H"),
        ("GD004x072501", "01"),
        ("GD0044x72501", "02"),
        ("GD004407250x", "03"),
        ("GD0044076901", "04"),
        ("GD0725004401", "05"),
        ("MD004x072501000", "01"),
        ("MD00440725x1000", "03"),
        ("MD004407250100x", "07"),
        ("MD0044072501x00", "06"),
        ("MS0769076901000", "04"),
        ("GD0044072501", "10"),
        ("TM3", "01"),
        ("TM1", "04"),
        ("TM2", "03"),
        ("SSabcdef", "01"),
        ("SS000001", "02"),
        ("SS019200", "03"),
        ("CRxx", "01"),
        ("CR11", "02"),
        ("CR00", "03"),
        ("CR99", "03"),
        ("HS2", "01"),
        ("HS0", "02"),
    ],
)
def test_what_cannot_be_is_refused_with_its_status(line: str, code: str) -> None:
    measured = Measured()
    assert measured.ask(line) == code
    assert measured.urg.read("laser") == 0


def test_the_laser_is_switched_on_and_off() -> None:
    measured = Measured()
    assert [measured.ask("BM"), measured.ask("BM")] == ["00", "02"]
    assert measured.urg.read("laser") == 1
    assert measured.ask("QT") == "00"
    assert measured.urg.read("laser") == 0


def test_distances_are_those_of_the_world() -> None:
    numbers = Measured(AHEAD).scan()
    assert len(numbers) == 682
    assert numbers[384 - 44] == 2_000
    assert numbers[384 - 44 + 128] == 2_828  # 45 degrees to the left
    assert numbers[384 - 44 - 128] == 2_828


def test_step_by_step_it_looks_to_the_left() -> None:
    measured = Measured(World(posts=(Post(0, 1.5, 0.5),)))
    assert measured.scan("GD0640064000") == (1_000,)
    assert measured.scan("GD0128012800") == (1,)


def test_the_pose_of_the_sensor_counts() -> None:
    measured = Measured(AHEAD)
    for name, value in (("x_m", 1.0), ("heading_rad", pi / 2)):
        measured.urg.inputs.set(name, value)
    assert measured.scan("GD0128012801") == (1_000,)
    assert measured.urg.read("ahead_m") == -1
    measured.urg.inputs.set("heading_rad", 0.0)
    assert measured.urg.read("ahead_m") == 1


def test_somebody_steps_in_its_way() -> None:
    measured = Measured(AHEAD)
    for name, value in (("post_x_m", 1.0), ("post_radius_m", 0.25)):
        measured.urg.inputs.set(name, value)
    assert measured.scan(f"GD{FRONT}") == (750,)


def test_what_is_no_distance_is_a_code_below_20() -> None:
    far = Measured(World((Wall(5.7, -1, 5.7, 1), Wall(-0.01, -9, -0.01, 9))))
    assert far.scan("GD0000000000") == (19,)
    assert far.scan("GD0726076800") == (19,) * 43
    assert far.scan(f"GD{FRONT}") == (1,)
    far.urg.inputs.set("heading_rad", pi)
    assert far.scan(f"GD{FRONT}") == (6,)


def test_a_cluster_gives_its_least_distance() -> None:
    measured = Measured(World(posts=(Post(1, 0, 0.001),)))
    assert measured.scan("GD0382038703") == (999, 1)


@pytest.mark.parametrize(
    ("command", "count"), [("GD0044072510", 68), ("GD0044004699", 0), ("MS0044072504", 170)]
)
def test_steps_behind_the_last_whole_cluster_have_no_number(command: str, count: int) -> None:
    measured = Measured(AHEAD)  # hokuyoaist takes (end - start + 1) // cluster for an error if not
    if command.startswith("G"):
        assert len(measured.scan(command)) == count
    else:
        *_, reply = measured.replies(210, f"{command}001\n".encode())
        assert len(parse_scan(reply.lines, 2)[1]) == count


def test_two_characters_carry_4095_at_most() -> None:
    measured = Measured(World((Wall(5, -1, 5, 1),)))
    assert measured.scan(f"GS{FRONT}") == (4_095,)
    assert measured.scan(f"GD{FRONT}") == (5_000,)


def test_blocks_have_64_characters_and_a_sum() -> None:
    measured = Measured(AHEAD)
    measured.ask("BM")
    (reply,) = measured.replies(210, b"GD0044072501\n")
    assert [len(line) for line in reply.lines] == [5, *[65] * 31, 63]


def test_a_single_scan_waits_for_the_first_whole_turn() -> None:
    measured = Measured(AHEAD)
    measured.run(30)
    measured.ask("BM")
    assert measured.ask(f"GD{FRONT}") == ""
    assert measured.ask(f"GD{FRONT}") == "0B"
    measured.run(200 - 33 - 1)
    assert len(measured.sent) == 2
    (reply,) = measured.replies(1)
    assert parse_scan(reply.lines, 3) == (100, (2_000,))
    assert measured.ask(f"GD{FRONT}") == "00"


def test_scans_come_one_after_the_other() -> None:
    measured = Measured(AHEAD)
    replies = measured.replies(450, f"MD{FRONT}003\n".encode())
    assert replies[0] == Reply(f"MD{FRONT}003".encode(), "00")
    assert [reply.echo[-2:] for reply in replies[1:]] == [b"02", b"01", b"00"]
    assert [parse_scan(reply.lines, 3) for reply in replies[1:]] == [
        (100, (2_000,)),
        (200, (2_000,)),
        (300, (2_000,)),
    ]
    assert {reply.status for reply in replies[1:]} == {"99"}
    assert measured.urg.read("laser") == 0
    assert measured.urg.due_us == NEVER


def test_scans_without_number_go_on_until_quit() -> None:
    measured = Measured(AHEAD)
    replies = measured.replies(1_050, f"MS{FRONT}000\n".encode())
    assert [reply.echo[-2:] for reply in replies] == [b"00"] * 10
    assert measured.ask("QT") == "00"
    assert measured.run(500) == b""


def test_scans_are_left_out_between() -> None:
    replies = Measured(AHEAD).replies(1_000, f"MD{FRONT}200\n".encode())
    assert [parse_scan(reply.lines, 3)[0] for reply in replies[1:]] == [100, 400, 700]


def test_a_scan_that_had_begun_is_not_for_a_later_command() -> None:
    measured = Measured(AHEAD)
    measured.ask("BM")
    measured.run(250)
    reply = measured.replies(200, f"MD{FRONT}001\n".encode())[1]
    assert parse_scan(reply.lines, 3)[0] == 300


def test_a_command_is_not_taken_twice() -> None:
    measured = Measured(AHEAD)
    assert measured.ask(f"MD{FRONT}000") == "00"
    assert measured.ask(f"MD{FRONT}000") == "0B"
    assert measured.ask("PP") == "00"


def test_the_timer_is_told_in_adjust_mode_alone() -> None:
    measured = Measured()
    measured.ask("BM")
    assert [measured.ask("TM0"), measured.ask("TM0")] == ["00", "02"]
    assert measured.urg.read("laser") == 0
    assert [measured.ask("BM"), measured.run(1, b"QT\n")] == ["0E", b"QT\n0Ee\n\n"]
    (reply,) = measured.replies(1, b"TM1\n")
    assert parse_number(reply.lines[0][:-1]) == 6
    assert [measured.ask("TM2"), measured.ask("BM")] == ["00", "00"]


def test_the_timer_wraps_after_24_bits() -> None:
    measured = Measured(dense=False)
    measured.now_us = (2**24 - 1) * 1_000
    measured.ask("TM0")
    measured.now_us = (2**24 + 7) * 1_000 - 1_000
    (reply,) = measured.replies(1, b"TM1\n")
    assert parse_number(reply.lines[0][:-1]) == 7


def test_reset_command_undoes_what_was_set() -> None:
    measured = Measured()
    for line in ("CR10", "SS750000", "HS1", "TM0"):
        measured.ask(line)
    assert measured.ask("RS") == "00"
    (reply,) = measured.replies(1, b"II\n")
    assert b"SCSP:Initial(600[rpm])<-Default setting by user;A" in reply.lines
    assert b"SBPS:19200[bps]<-Default setting by user;A" in reply.lines
    assert reply.lines[5].startswith(b"TIME:000001")


def test_on_rs232_its_line_has_the_bit_rate_that_was_set() -> None:
    urg = Urg(UrgParameters(scip="2.0", rs232_baud=38_400))
    assert urg.uart == UartSetting(38_400)
    assert urg.tick(1_000, b"SS115200\n") == b"SS115200\n00P\n\n"
    assert urg.uart == UartSetting(115_200)
    assert b"SBPS:115200[bps];" in urg.tick(2_000, b"II\n")
    urg.tick(3_000, b"RS\n")
    assert urg.uart == UartSetting(38_400)
    assert b"SBPS:38400[bps]<-Default setting by user;" in urg.tick(4_000, b"II\n")


def test_on_usb_its_line_has_no_setting() -> None:
    measured = Measured()
    assert measured.ask("SS115200") == "00"
    assert measured.urg.uart is None


def test_a_slower_mirror_takes_longer() -> None:
    measured = Measured(AHEAD)
    measured.ask("BM")
    measured.ask("CR10")
    assert measured.urg.read("speed_rpm") == 540
    replies = measured.replies(400, f"MD{FRONT}000\n".encode())
    times = [parse_scan(reply.lines, 3)[0] for reply in replies[1:]]
    assert [b - a for a, b in pairwise(times)] == [111]


@pytest.mark.parametrize(
    ("fault", "code", "text", "on"),
    [
        ("laser_broken", "50", b"STAT:Laser trouble.", "01"),
        ("motor_jammed", "51", b"STAT:Motor trouble.", "01"),
    ],
)
def test_trouble_ends_a_measurement_with_its_status(
    fault: str, code: str, text: bytes, on: str
) -> None:
    measured = Measured(AHEAD)
    measured.ask("BM")
    measured.ask(f"GD{FRONT}")
    measured.ask(f"MD{FRONT}000")
    measured.urg.inputs.set(fault, 1)
    replies = measured.replies(10)
    assert [(reply.echo[:2], reply.status) for reply in replies] == [(b"GD", code), (b"MD", code)]
    assert [measured.ask("BM"), measured.ask(f"MD{FRONT}000")] == [on, code]
    assert measured.ask(f"GD{FRONT}") == code
    (reply,) = measured.replies(1, b"II\n")
    assert reply.lines[-1].startswith(text)
    measured.urg.inputs.set(fault, 0)
    assert measured.scan(f"GD{FRONT}") == (2_000,)


def test_a_jammed_mirror_stands() -> None:
    measured = Measured()
    measured.urg.inputs.set("motor_jammed", 1)
    assert measured.urg.read("speed_rpm") == 0


def test_without_supply_it_is_silent_and_forgets() -> None:
    measured = Measured(AHEAD)
    measured.ask(f"MD{FRONT}000")
    measured.run(1, b"half a comm")
    measured.urg.inputs.set("power_cut", 1)
    assert measured.run(500, b"VV\n") == b""
    assert measured.urg.due_us == NEVER
    assert measured.urg.read("speed_rpm") == 0
    measured.urg.inputs.set("power_cut", 0)
    assert measured.run(500) == b""
    assert measured.ask("BM") == "00"
    assert measured.urg.read("served") == 1


def test_reset_begins_as_after_power_up() -> None:
    measured = Measured(AHEAD)
    measured.ask(f"MD{FRONT}000")
    measured.urg.reset()
    assert measured.run(500) == b""
    assert (measured.urg.read("laser"), measured.urg.read("scans")) == (0, 0)


def test_noise_is_that_of_its_accuracy_and_seed() -> None:
    wide = World((Wall(2, -50, 2, 50),))
    numbers = Measured(wide, noise=1.0, seed=1).scan("GD0380038800")
    assert all(1_975 < number < 2_025 for number in numbers)
    assert len(set(numbers)) > 3
    assert numbers == Measured(wide, noise=1.0, seed=1).scan("GD0380038800")
    assert numbers != Measured(wide, noise=1.0, seed=2).scan("GD0380038800")


def test_noise_of_a_step_does_not_depend_on_who_asks() -> None:
    wide, narrow = (Measured(room(3, 3), noise=1.0) for _ in range(2))
    assert wide.scan("GD0300040000")[84:85] == narrow.scan("GD0384038400")


def test_it_counts_scans_and_commands() -> None:
    measured = Measured(AHEAD)
    measured.scan()
    assert (measured.urg.read("scans"), measured.urg.read("served")) == (1, 3)


def test_it_is_a_device_of_a_millisecond_with_named_ends() -> None:
    urg = Measured().urg
    assert (urg.tick_us, set(urg.outputs)) == (1_000, {output.name for output in OUTPUTS})
    assert set(urg.inputs.table) == {item.name for item in INPUTS}
    with pytest.raises(KeyError):
        urg.read("no such thing")


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"noise": 2.0}, "noise 2.0 is not in 0..1"),
        ({"serial": "a b"}, "serial 'a b' is not"),
        ({"scip": "3"}, "scip '3' is not one of 1.1, 2.0"),
        ({"rs232_baud": 0}, "rs232_baud 0 bit/s is below 1"),
    ],
)
def test_parameters_that_cannot_be_are_refused(settings: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        UrgParameters(**settings)  # type: ignore[arg-type]


def test_it_is_due_for_what_is_switched_and_not_for_where_it_is_put() -> None:
    urg = Measured(AHEAD).urg
    assert urg.due_us == 0
    urg.tick(1_000, b"")
    assert urg.due_us == NEVER
    urg.inputs.set("x_m", 1.0)
    assert urg.due_us == NEVER
    for name in ("power_cut", "laser_broken", "motor_jammed"):
        urg.inputs.set(name, 1)
        assert urg.due_us == 0
        urg.tick(2_000, b"")
        assert urg.due_us == NEVER
