"""Values pass between our ports and those of a foreign component; what is wrong hurts nobody."""

from __future__ import annotations

import pytest

from tests.host.rtc.engines.openrtm.ports.foreign import Peer, Served

BOTH_WAYS = pytest.mark.parametrize("first", ["ours", "theirs"])
ENDIANS = pytest.mark.parametrize("endian", ["little", "big", "middle,big,little"])


def join(system: Served, peer: Peer, first: str, ours: str, theirs: str, **values: str) -> None:
    """Connect a port of ours with one of a peer; `__` in a key is a dot."""
    ports = [system.service(ours), system.reference(peer.iors[theirs])]
    if first == "theirs":
        ports.reverse()
    keys = {f"dataport__{key}": text for key, text in values.items()}
    code, profile = system.connect(*ports, connector_id="9c1f", **keys)
    assert (code, profile.connector_id) == ("RTC_OK", "9c1f")
    assert peer.ask("connectors")[theirs] == ["9c1f"]


@BOTH_WAYS
@ENDIANS
def test_our_values_are_pushed_to_a_peer(
    system: Served, peer: Peer, first: str, endian: str
) -> None:
    join(system, peer, first, "ConsoleIn0.out", "in", serializer__cdr__endian=endian)
    system.console_in.enter(1, -5, 2_147_483_647)
    system.until(lambda: len(peer.ask("received")) == 3)
    assert [number for _, _, number in peer.ask("received")] == [1, -5, 2_147_483_647]


@BOTH_WAYS
@ENDIANS
def test_a_peer_pushes_its_values_to_us(
    system: Served, peer: Peer, first: str, endian: str
) -> None:
    join(system, peer, first, "ConsoleOut0.in", "out", serializer__cdr__endian=endian)
    assert peer.ask("put", 1, -5, 2_147_483_647) == ["PORT_OK"] * 3
    system.until(lambda: len(system.numbers) == 3)
    assert system.numbers == [1, -5, 2_147_483_647]
    assert (system.console_out.received[0].tm.sec, system.console_out.received[0].tm.nsec) == (1, 2)


@BOTH_WAYS
@ENDIANS
def test_a_peer_pulls_our_values(system: Served, peer: Peer, first: str, endian: str) -> None:
    keys = {"dataflow_type": "pull", "serializer__cdr__endian": endian}
    join(system, peer, first, "ConsoleIn0.out", "in", **keys)
    assert peer.ask("get") == ["BUFFER_EMPTY"]
    system.console_in.enter(1, -5)
    system.until(lambda: not system.console_in.waiting)
    assert [peer.ask("get")[1] for _ in range(3)] == [1, -5, -5]  # read back


def test_a_peer_is_told_that_a_buffer_is_empty(system: Served, peer: Peer) -> None:
    keys = {"dataflow_type": "pull", "buffer__read__empty_policy": "do_nothing"}
    join(system, peer, "ours", "ConsoleIn0.out", "in", **keys)
    system.console_in.enter(1)
    system.until(lambda: not system.console_in.waiting)
    assert [peer.ask("get") for _ in range(2)] == [["PORT_OK", 1], ["BUFFER_EMPTY"]]


@BOTH_WAYS
@ENDIANS
def test_we_pull_the_values_of_a_peer(system: Served, peer: Peer, first: str, endian: str) -> None:
    peer.ask("wait", 1, -5)
    join(
        system,
        peer,
        first,
        "ConsoleOut0.in",
        "out",
        dataflow_type="pull",
        serializer__cdr__endian=endian,
    )
    system.until(lambda: system.numbers == [1, -5])
    peer.ask("wait", 7)
    system.until(lambda: system.numbers == [1, -5, 7])


def test_an_empty_buffer_of_openrtm_python_is_no_lost_peer(
    system: Served, peer: Peer, caplog: pytest.LogCaptureFixture
) -> None:
    peer.ask("lie", "get", "empty text")
    join(system, peer, "ours", "ConsoleOut0.in", "out", dataflow_type="pull")
    for _ in range(50):
        system.step()
    peer.ask("lie", "get")
    peer.ask("wait", 3)
    system.until(lambda: system.numbers == [3])
    assert caplog.records == []


def test_the_status_of_a_full_buffer_is_told(system: Served, peer: Peer) -> None:
    system.step()
    system.manager.deactivate("ConsoleOut0")
    system.step()
    keys = {"buffer__length": "2", "buffer__write__full_policy": "do_nothing"}
    join(system, peer, "ours", "ConsoleOut0.in", "out", **keys)
    assert peer.ask("put", 1, 2, 3) == ["PORT_OK", "PORT_OK", "BUFFER_FULL"]


@pytest.mark.parametrize(
    "data", ["", "00", "ff" * 13, "00" * 100_000], ids=["none", "one", "thirteen", "many"]
)
def test_bytes_that_are_no_value_are_refused(
    system: Served, peer: Peer, data: str, caplog: pytest.LogCaptureFixture
) -> None:
    join(system, peer, "ours", "ConsoleOut0.in", "out")
    if data:
        assert [peer.ask("raw", data) for _ in range(3)] == ["UNKNOWN_ERROR"] * 3
        assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert peer.ask("put", 1) == ["PORT_OK"]
    system.until(lambda: system.numbers == [1])


@pytest.mark.parametrize("lie", ["raise", "unknown", "PORT_ERROR", "BUFFER_FULL"])
def test_a_peer_that_answers_a_put_with_nonsense_costs_a_line(
    system: Served, peer: Peer, lie: str, caplog: pytest.LogCaptureFixture
) -> None:
    join(system, peer, "ours", "ConsoleIn0.out", "in")
    peer.ask("lie", "put", lie)
    system.console_in.enter(1, 2)
    (connector,) = system.manager.port("ConsoleIn0.out").connectors
    system.until(lambda: connector.refused == 2)
    peer.ask("lie", "put")
    system.console_in.enter(3)
    system.until(lambda: peer.ask("received"))
    assert len(caplog.records) == (lie in {"raise", "unknown"})


@pytest.mark.parametrize("lie", ["raise", "unknown", "noise", "huge", "UNKNOWN_ERROR"])
def test_a_peer_that_answers_a_get_with_nonsense_costs_a_line(
    system: Served, peer: Peer, lie: str, caplog: pytest.LogCaptureFixture
) -> None:
    peer.ask("lie", "get", lie)
    join(system, peer, "ours", "ConsoleOut0.in", "out", dataflow_type="pull")
    for _ in range(50):
        system.step()
    peer.ask("lie", "get")
    peer.ask("wait", 3)
    system.until(lambda: system.numbers == [3])
    assert len(caplog.records) == 1


@pytest.mark.parametrize(
    ("lie", "code"),
    [
        ("raise", "RTC_ERROR"),
        ("UNSUPPORTED", "UNSUPPORTED"),
        ("PRECONDITION_NOT_MET", "PRECONDITION_NOT_MET"),
        ("other", "BAD_PARAMETER"),
    ],
)
def test_a_peer_that_cannot_be_joined_leaves_nothing_behind(
    system: Served, peer: Peer, lie: str, code: str, caplog: pytest.LogCaptureFixture
) -> None:
    peer.ask("lie", "notify_connect", *lie.split())
    ports = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    answer, _ = system.connect(*ports, connector_id="9c1f", dataport__data_type="TimedLong")
    assert answer == code
    assert system.manager.port("ConsoleIn0.out").connectors == ()
    assert len(caplog.records) == 1
    peer.ask("lie", "notify_connect")
    join(system, peer, "ours", "ConsoleIn0.out", "in")


@pytest.mark.parametrize("ior", ["nonsense", "IOR:00", "corbaloc::127.0.0.1:1/nobody"])
def test_a_reference_that_leads_nowhere_is_refused_or_nobody_is_there(
    system: Served, peer: Peer, ior: str, caplog: pytest.LogCaptureFixture
) -> None:
    peer.ask("lie", "ior", ior)
    ports = system.service("ConsoleIn0.out"), system.reference(peer.iors["in"])
    code, _ = system.connect(*ports)
    connectors = system.manager.port("ConsoleIn0.out").connectors
    assert (code, len(connectors)) == (("RTC_OK", 1) if "1/" in ior else ("BAD_PARAMETER", 0))
    if connectors:
        system.console_in.enter(1)
        system.until(lambda: connectors[0].state == "lost")
    assert len(caplog.records) == 1
