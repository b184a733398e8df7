from __future__ import annotations

import pytest

from tests.host.rigs import ScriptedLink, powered_off_bench, standby_bench
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc import RrcClient, RrcRefused


def test_start_waits_100_ms_behind_the_dummy_command() -> None:
    link = ScriptedLink({b"device": [b"OK:device\nRRC\n"]})
    RrcClient(link).start()
    assert link.sent == [b"\ndevice", b"device"]
    assert link.now_us == 100_000 + link.delay_us


def test_start_drops_what_was_in_the_receive_buffer() -> None:
    link = ScriptedLink({b"device": [b"OK:device\nRRC\n"]})
    link.comes(0, b"EV:Initialized\nSA:00000000A10000\nER:output\n<noise\nOK:dev")
    client = RrcClient(link)
    client.start()
    assert list(client.events(0)) == []
    assert client.latest_status is None
    assert list(client.unknown) == []


def test_a_half_line_in_the_rrc_does_not_spoil_the_start() -> None:
    bench = powered_off_bench()
    bench.link.send(b"outp")
    bench.client.start()
    assert bench.client.device() == "RRC"


def test_start_finds_out_that_stablemode_is_on() -> None:
    bench = standby_bench(stable=True)
    successor = RrcClient(bench.link)
    successor.start()
    assert successor.stable
    assert successor.version() == "Version 1.0"


def test_a_silent_line_is_a_timeout_that_says_what_was_asked() -> None:
    client = RrcClient(ScriptedLink())
    with pytest.raises(
        LinkTimeout, match=r"'device', waited 200 ms, the answer of device did not come"
    ):
        client.start()


def test_a_device_that_does_not_know_device_is_no_rrc() -> None:
    link = ScriptedLink({b"device": [b"ER:CommandUnknown\n"]})
    with pytest.raises(RrcRefused, match="ER:CommandUnknown"):
        RrcClient(link).start()


def test_starting_again_lifts_a_stop() -> None:
    bench = powered_off_bench(max_refusals=1)
    with pytest.raises(Exception, match="1 refusals in a row"):
        bench.client.limit(100, 100)
    bench.client.start()
    assert not bench.client.stopped


def test_a_client_closes_its_link_at_the_end_of_with() -> None:
    bench = powered_off_bench()
    with bench.client:
        pass
    with pytest.raises(ConnectionError, match="closed"):
        bench.client.device()
