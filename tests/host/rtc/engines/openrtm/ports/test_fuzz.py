"""Whatever comes to the servants, they answer, and the system goes on."""

from __future__ import annotations

import logging
import random
import socket
import threading
from typing import Any

import pytest
from omniORB import any as omni_any

from tests.host.rtc.engines.openrtm.name_server import free_port
from tests.host.rtc.engines.openrtm.ports.foreign import Peer, Served
from tests.wire.rtc_types.test_rtc_types import TYPES
from tickrig.host.rtc.engines.openrtm.connector_ends import InPortAnswers
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.engines.peer_ports import InPortPushConnector, PeerEnd, cdr
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.wire.rtc_types.cdr import Endian, encode

CODES = {"RTC_OK", "RTC_ERROR", "BAD_PARAMETER", "PRECONDITION_NOT_MET"}


def mutated(data: bytes, chance: random.Random) -> bytes:
    """Return bytes with some changed, cut off, put in or repeated."""
    found = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(found) + 1)
        match chance.randrange(5):
            case 0:
                found[place : place + 1] = chance.randbytes(1)
            case 1:
                found[place : place + 4] = chance.choice((b"\xff" * 4, b"\0\0\0\x80", b"\x7f" * 4))
            case 2:
                del found[place:]
            case 3:
                found[place:place] = chance.randbytes(chance.randrange(9))
            case _:
                found += found[place:]
    return bytes(found[:4_096])


def test_ten_thousand_payloads_are_taken_or_refused(caplog: pytest.LogCaptureFixture) -> None:
    chance, calls, statuses = random.Random(19), CallQueue(), set()
    per_type = 13_500 // len(TYPES)
    with caplog.at_level(logging.CRITICAL):
        for kind in TYPES:
            endian = chance.choice(list(Endian))
            port: InPort[Any] = InPort("in", kind)
            connector = InPortPushConnector(port, PeerEnd("peer", "a"), cdr(kind, endian), calls)
            connector.begin()
            answers, valid = InPortAnswers(connector), encode(kind(), endian)
            for _ in range(per_type):
                statuses.add(str(answers.put(mutated(valid, chance))))
            assert str(answers.put(valid)) == "PORT_OK"
            calls.serve(0)
            assert all(isinstance(value, kind) for value in connector.buffer.clear())
    calls.close()
    assert statuses == {"PORT_OK", "UNKNOWN_ERROR"}


class Profiles:
    """ConnectorProfiles as nobody would make them, of parts that each might come."""

    def __init__(self, system: Served, peer: Peer, chance: random.Random) -> None:
        self._chance = chance
        nowhere = system.orb.reference(f"corbaloc::127.0.0.1:{free_port()}/nobody")
        ours = [system.service(name) for name in ("ConsoleIn0.out", "ConsoleOut0.in")]
        self._ours = [*ours * 5, None]
        theirs = [system.reference(peer.iors[name]) for name in ("in", "out", "provides")]
        self._all = [*ours * 5, *theirs, None, nowhere._unchecked_narrow(stubs().rtc.PortService)]
        self._ior = peer.iors["in"]

    def make(self) -> Any:
        chance, rtc = self._chance, stubs().rtc
        ports = [chance.choice(self._all) for _ in range(chance.choice((2, 2, 2, 2, 0, 1, 3)))]
        ports[:1] = [chance.choice(self._ours)] if ports else []
        items = [self._item() for _ in range(chance.randrange(6))]
        name, id_ = (chance.choice(("", "a", "b\nc", "é" * 300)) for _ in range(2))
        return rtc.ConnectorProfile(name, id_, ports, items)

    def _item(self) -> Any:
        chance = self._chance
        key = "dataport." + chance.choice(KEYS)
        words = (*WORDS, self._ior, mutated(self._ior.encode(), chance).decode("latin-1"))
        value: object = chance.choice(words).replace("\0", "")
        if chance.random() < 0.1:
            value = chance.choice((0, -1.5, True, [1, 2], [["x"]]))
        return stubs().sdo.NameValue(key, omni_any.to_any(value))


KEYS = (
    *("interface_type", "dataflow_type", "subscription_type", "data_type", "buffer.length", ""),
    *("serializer.cdr.endian", "publisher.push_rate", "publisher.push_policy", "é"),
    *("corba_cdr.inport_ior", "corba_cdr.outport_ior", "inport.buffer.length"),
)
WORDS = (
    *("corba_cdr", "direct", "push", "pull", "new", "periodic", "flush", "big", "little,big"),
    *("", "0", "-1", "9" * 400, "1e999", "nan", "IDL:RTC/TimedLong:1.0", "IOR:", "é" * 5_000),
    *("IOR:" + "0" * 999, "corbaname:", "corbaloc::127.0.0.1:1/x", "file:///etc/passwd"),
)


def test_ten_thousand_profiles_are_answered(
    system: Served, peer: Peer, caplog: pytest.LogCaptureFixture
) -> None:
    chance = random.Random(19)
    profiles = Profiles(system, peer, chance)
    services = [system.service(name) for name in ("ConsoleIn0.out", "ConsoleOut0.in")]
    codes: dict[str, int] = {}

    def call() -> None:
        for number in range(10_000):
            service, profile = chance.choice(services), profiles.make()
            operation = chance.choice((service.connect, service.notify_connect))
            code, answer = operation(profile)
            codes[str(code)] = codes.get(str(code), 0) + 1
            if number % 5 == 0:
                service.get_port_profile()
                service.disconnect(chance.choice(("", "a", "nobody's", answer.connector_id)))
            if number % 7 == 0:
                service.disconnect_all()
        for service in services:
            service.disconnect_all()

    with caplog.at_level(logging.ERROR):
        thread = threading.Thread(target=call)
        thread.start()
        while thread.is_alive():
            system.calls.serve(1_000)
    assert set(codes) <= CODES
    assert codes["RTC_OK"] > 100
    assert codes["BAD_PARAMETER"] > 1_000
    assert "raised" not in caplog.text
    assert (system.console_in.out.connectors, system.console_out.in_.connectors) == ((), ())
    assert system.connect(*services)[0] == "RTC_OK"
    system.console_in.enter(5)
    system.until(lambda: system.numbers == [5])


def test_noise_at_the_socket_ends_nobody(system: Served) -> None:
    chance, port = random.Random(19), system.orb.endpoint.port
    request = b"GIOP\1\2\1\0" + (60).to_bytes(4, "little") + bytes(56)
    for _ in range(300):
        with socket.create_connection(("127.0.0.1", port)) as connection:
            connection.sendall(mutated(request, chance))
    profile = system.do(system.service("ConsoleIn0.out").get_port_profile)
    assert profile.name == "ConsoleIn0.out"
