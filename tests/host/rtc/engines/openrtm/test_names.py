from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import CosNaming
import CosNaming__POA
import pytest
from omniORB import URI

from tests.host.rtc.engines.openrtm.name_server import OmniNames, eventually
from tickrig.host.cli.engine_options import parse_endpoint
from tickrig.host.rtc.engines.openrtm.names import NameServer
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference

pytestmark = pytest.mark.realtime

SOON_US = 20_000
NAME = "robot.host_cxt/ConsoleIn0.rtc"


class Destroyed:
    """Answers a single operation of an interface that omniORB brings along."""

    def __init__(self) -> None:
        self.calls = 0

    def destroy(self) -> None:
        self.calls += 1


def serve(orb: Orb) -> Reference:
    return orb.serve(CosNaming__POA.BindingIterator, Destroyed())


@contextmanager
def names_at(
    orb: Orb, server: OmniNames, renew_us: int = SOON_US, look_us: int = SOON_US
) -> Iterator[NameServer]:
    names = NameServer(orb, parse_endpoint(server.address), renew_us, look_us)
    try:
        yield names
    finally:
        names.close()


def resolve(orb: Orb, server: OmniNames, name: str = NAME) -> Any:
    """Return what a name server has under a name; None without it."""
    root = orb.reference(f"corbaloc::{server.address}/NameService")._narrow(CosNaming.NamingContext)
    try:
        return root.resolve(URI.stringToName(name))
    except CosNaming.NamingContext.NotFound:
        return None


def test_a_name_is_bound_below_its_context_and_taken_away_at_the_end(
    orb: Orb, omni_names: OmniNames
) -> None:
    reference = serve(orb)
    with names_at(orb, omni_names) as names:
        names.bind(NAME, reference)
        eventually(lambda: resolve(orb, omni_names) is not None, "it has no name")
        assert resolve(orb, omni_names)._is_equivalent(reference)
    assert resolve(orb, omni_names) is None
    assert resolve(orb, omni_names, "robot.host_cxt") is not None


def test_a_name_that_is_taken_away_is_gone_and_the_others_stay(
    orb: Orb, omni_names: OmniNames
) -> None:
    with names_at(orb, omni_names) as names:
        names.bind("a.host_cxt/b.sub/First0.rtc", serve(orb))
        names.bind(NAME, serve(orb))
        eventually(lambda: resolve(orb, omni_names) is not None, "it has no name")
        names.unbind(NAME)
        eventually(lambda: resolve(orb, omni_names) is None, "it has its name yet")
        assert resolve(orb, omni_names, "a.host_cxt/b.sub/First0.rtc") is not None


def test_a_name_that_somebody_else_has_by_now_stays_theirs(orb: Orb, omni_names: OmniNames) -> None:
    other = serve(orb)
    with names_at(orb, omni_names, renew_us=60_000_000) as names:
        names.bind(NAME, serve(orb))
        eventually(lambda: resolve(orb, omni_names) is not None, "it has no name")
        with names_at(orb, omni_names) as others:
            others.bind(NAME, other)
            eventually(
                lambda: bool(resolve(orb, omni_names)._is_equivalent(other)), "it is not theirs"
            )
            names.close()
            assert resolve(orb, omni_names)._is_equivalent(other)


def test_a_name_server_that_was_restarted_is_filled_again(
    orb: Orb, omni_names: OmniNames, caplog: pytest.LogCaptureFixture
) -> None:
    with names_at(orb, omni_names) as names:
        names.bind(NAME, serve(orb))
        eventually(lambda: resolve(orb, omni_names) is not None, "it has no name")
        omni_names.kill()
        eventually(lambda: not names.answers, "nobody noticed that it is gone")
        omni_names.start()
        eventually(lambda: names.answers, "nobody noticed that it is back")
        assert resolve(orb, omni_names) is not None
    gone, back = (record.getMessage() for record in caplog.records)
    assert gone.startswith(f"name server {omni_names.address}: ")
    assert back.startswith(f"name server {omni_names.address} answers again, after ")


def test_a_name_server_that_is_not_there_is_told_in_one_line_and_found_when_it_comes(
    orb: Orb, omni_names: OmniNames, caplog: pytest.LogCaptureFixture
) -> None:
    omni_names.kill()
    with names_at(orb, omni_names) as names:
        names.bind(NAME, serve(orb))
        eventually(lambda: not names.answers, "nobody noticed that it is not there")
        omni_names.start()
        eventually(lambda: names.answers, "nobody noticed that it is there")
        assert resolve(orb, omni_names) is not None
    where = f"name server {omni_names.address}"
    assert caplog.messages[0] == f"{where}: not reachable; asked again every 0.02 s"
    assert len(caplog.messages) == 2


def test_a_name_server_that_hangs_is_told_in_one_line_and_holds_up_nobody(
    orb: Orb, omni_names: OmniNames, caplog: pytest.LogCaptureFixture
) -> None:
    omni_names.pause()
    with names_at(orb, omni_names) as names:
        for number in range(100):  # each would wait for 1 s
            names.bind(f"robot.host_cxt/ConsoleIn{number}.rtc", serve(orb))
        eventually(lambda: not names.answers, "nobody noticed that it hangs")
        omni_names.resume()
        eventually(lambda: names.answers, "nobody noticed that it goes on")
        assert resolve(orb, omni_names, "robot.host_cxt/ConsoleIn99.rtc") is not None
    assert "no answer within 1 s; asked again every 0.02 s" in caplog.text
    assert len(caplog.messages) == 2


def test_a_name_server_that_hangs_does_not_hold_up_the_end_for_long(
    orb: Orb, omni_names: OmniNames
) -> None:
    with names_at(orb, omni_names) as names:
        names.bind(NAME, serve(orb))
        eventually(lambda: resolve(orb, omni_names) is not None, "it has no name")
        omni_names.pause()
    assert omni_names.hangs  # and yet it has ended
    omni_names.resume()


def test_who_answers_and_is_no_name_service_is_told(
    orb: Orb, caplog: pytest.LogCaptureFixture
) -> None:
    orb.serve_as("NameService", CosNaming__POA.BindingIterator, Destroyed())
    names = NameServer(orb, orb.endpoint, SOON_US, SOON_US)
    eventually(lambda: not names.answers, "nobody noticed")
    names.close()
    assert caplog.messages == [
        f"name server {orb.endpoint}: it is no name service; asked again every 0.02 s"
    ]


def test_a_name_that_cannot_be_is_told_once(
    orb: Orb, omni_names: OmniNames, caplog: pytest.LogCaptureFixture
) -> None:
    with names_at(orb, omni_names) as names:
        names.bind("robot.host_cxt", serve(orb))  # an object where a context is wanted
        names.bind(NAME, serve(orb))
        names.bind("First0.rtc", serve(orb))
        eventually(lambda: resolve(orb, omni_names, "First0.rtc") is not None, "it has no name")
        eventually(lambda: bool(caplog.messages), "nothing was told")
    assert caplog.messages == [f"name server {omni_names.address} refuses {NAME}: NotFound"]


class Nothing:
    """A name server that takes each name, and has nothing under it."""

    def __init__(self) -> None:
        self.bound: list[str] = []

    def rebind(self, name: Any, reference: Reference) -> None:
        self.bound.append(URI.nameToString(name))

    def resolve(self, name: Any) -> None:
        return None


def test_a_name_server_that_answers_with_nothing_costs_no_other_name(
    orb: Orb, caplog: pytest.LogCaptureFixture
) -> None:
    server = Nothing()
    orb.serve_as("NameService", CosNaming__POA.NamingContext, server)
    names = NameServer(orb, orb.endpoint, SOON_US, SOON_US)
    names.bind(NAME, serve(orb))
    eventually(lambda: NAME in server.bound, "it was not bound")
    names.unbind(NAME)
    names.bind("other.rtc", serve(orb))
    eventually(lambda: "other.rtc" in server.bound, "the other name was not bound")
    names.close()
    assert caplog.text == ""
