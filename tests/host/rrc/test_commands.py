from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.host.rigs import ScriptedLink, powered_off_bench, standby_bench
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc import RrcClient, RrcRefused
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rrc.commands import BadParameters

SAMPLES: list[tuple[Callable[[RrcClient], object], bytes]] = [
    (lambda rrc: rrc.limit(50, 50), b"limit3232ffffff"),
    (lambda rrc: rrc.output(30, 0), b"output1e00"),
    (lambda rrc: rrc.speedmode(4), b"speedmode40"),
    (lambda rrc: rrc.speedmode(5, locked=True), b"speedmode51"),
    (lambda rrc: rrc.joystick(cmd.Joystick(reverse_mode=3)), b"joystick00006464003051e2d"),
    (lambda rrc: rrc.watchdog(1_000_000), b"watchdog64"),
    (lambda rrc: rrc.status(), b"statusA1"),
    (lambda rrc: rrc.status(on=False), b"statusA0"),
    (lambda rrc: rrc.stablemode(), b"stablemode1"),
    (lambda rrc: rrc.poweroff(), b"poweroff"),
    (
        lambda rrc: rrc.beep(*[1_000_000] * 4, *[100_000] * 6),
        b"beep646464640a0a0a0a0a0a",
    ),
    (lambda rrc: rrc.beep(500_000), b"beep32000000000000000000"),
]


@pytest.mark.parametrize(("call", "line"), SAMPLES)
def test_a_method_sends_its_command(call: Callable[[RrcClient], object], line: bytes) -> None:
    bench = standby_bench()
    call(bench.client)
    assert bench.link.lines == [line]


@pytest.mark.parametrize(
    ("ask", "answer"),
    [
        (RrcClient.device, "RRC"),
        (RrcClient.version, "Version 1.0"),
        (RrcClient.date, "Apr 30 2015 00:00:00"),
    ],
)
@pytest.mark.parametrize("stable", [False, True])
def test_a_query_returns_its_answer(
    ask: Callable[[RrcClient], str], answer: str, stable: bool
) -> None:
    assert ask(standby_bench(stable=stable).client) == answer


def test_a_command_takes_effect_before_its_method_returns() -> None:
    bench = standby_bench()
    bench.client.output(30, -5)
    assert bench.out_pct() == (30, -5)


def test_any_command_can_be_sent_as_a_value() -> None:
    bench = standby_bench()
    assert bench.client.command(cmd.SpeedMode(4)) == ""
    assert bench.rrc.read("speed_mode") == 4


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda rrc: rrc.output(101, 0), "output: #1 101 is not in -100..100"),
        (lambda rrc: rrc.watchdog(2_560_000), "watchdog: #1 256 is not in 0..255"),
        (lambda rrc: rrc.watchdog(15_000), "15000 us is not a multiple of 10000 us"),
        (lambda rrc: rrc.beep(*[0] * 11), "beep: 11 values, not 10"),
    ],
)
def test_a_value_out_of_range_is_never_sent(
    call: Callable[[RrcClient], object], message: str
) -> None:
    bench = standby_bench()
    with pytest.raises(ValueError, match=message):
        call(bench.client)
    assert bench.link.sent == []


def test_bad_parameters_name_the_command() -> None:
    with pytest.raises(BadParameters, match=r"speedmode: #1 6 is not in 1\.\.5"):
        standby_bench().client.speedmode(6)


def test_a_refusal_says_what_was_sent_what_came_and_why() -> None:
    bench = powered_off_bench()
    with pytest.raises(RrcRefused) as caught:
        bench.client.output(30, 0)
    assert caught.value.code == "output"
    assert caught.value.sent == "output1e00"
    assert "sent 'output1e00', the RRC answered ER:output: allowed only while VR2 is on" in str(
        caught.value
    )


def test_a_checksum_refusal_hints_at_stablemode() -> None:
    bench = standby_bench()
    bench.link.send(b"stablemode1\n")  # by somebody else
    bench.rig.run_for(20_000)
    with pytest.raises(RrcRefused, match="stablemode was on before") as caught:
        bench.client.status()
    assert caught.value.code == "CommandChecksum"


def test_a_lost_command_is_a_timeout_that_says_how_long_it_waited() -> None:
    bench = standby_bench()
    bench.link.spoil = lambda line: b""
    before_us = bench.link.now_us
    with pytest.raises(LinkTimeout, match=r"'beep0+', waited 200 ms, OK:beep did not come"):
        bench.client.beep()
    assert bench.link.now_us - before_us == 200_000


def test_the_time_to_wait_can_be_chosen() -> None:
    client = RrcClient(ScriptedLink(), timeout_us=1_000_000)
    with pytest.raises(LinkTimeout, match="waited 1000 ms"):
        client.device()


def test_a_late_reply_is_not_taken_for_the_next_commands() -> None:
    link = ScriptedLink({b"beep" + b"0" * 20: [b"OK:beep\n"], b"statusA1": [b"ER:status\n"]})
    client = RrcClient(link)
    link.delay_us = 205_000
    with pytest.raises(LinkTimeout):
        client.beep()
    link.delay_us = 10_000
    with pytest.raises(RrcRefused, match="ER:status"):
        client.status()


def test_a_newer_firmwares_message_is_not_taken_for_an_answer() -> None:
    link = ScriptedLink({b"version": [b"OK:version\nSB:0123\nVersion 1.0\n"]})
    client = RrcClient(link)
    assert client.version() == "Version 1.0"
    assert [arrival.value for arrival in client.unknown] == ["SB:0123"]


def test_confirmed_commands_never_overload_the_rrc() -> None:
    bench = standby_bench()
    bench.client.status()
    for _ in range(100):
        bench.client.output(10, 0)
    assert bench.state() == "Output"
    assert bench.rrc.read("backlog_pct") == 0
