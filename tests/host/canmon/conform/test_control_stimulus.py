"""The control socket of an emulator as the hand at its inputs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import pytest

from tickrig.device import make_f_palette
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import make_bench
from tickrig.emulators.canopen.node import Node
from tickrig.host.canmon.conform.stimulus import open_stimulus
from tickrig.host.canopen.conform.bus.exchange import NotAllowed
from tickrig.host.cli.messages import Refused
from tickrig.host.control.requests import Object, RequestDispatcher
from tickrig.host.control.server import ControlServer


@contextmanager
def served(path: Path, control: RequestDispatcher) -> Iterator[str]:
    server, ended = ControlServer(path, control), Event()

    def serve() -> None:
        while not ended.is_set():
            server.serve(1_000)

    thread = Thread(target=serve)
    thread.start()
    try:
        yield f"control:{path}"
    finally:
        ended.set()
        thread.join()
        server.close()


def test_an_emulator_tells_the_counts_of_its_converters(tmp_path: Path) -> None:
    wire = CanWire()
    palette = make_f_palette()
    emulator = make_bench(wire, [Node("palette", palette, wire)])
    with served(tmp_path / "ctl", EmulatorControl(emulator)) as place:
        stimulus = open_stimulus(place)
        stimulus("input", "ai1", "1000")
        with pytest.raises(NotAllowed, match="ai1_v has no step of 999 counts"):
            stimulus("input", "ai1", "999")
    emulator.rig.run_to(10_000)
    assert palette.dictionary[0x6401, 1].number == 1_000


@pytest.mark.parametrize("described", [{"inputs": [{}]}, {"inputs": 5}, {"outputs": ["do"]}])
def test_what_describes_itself_otherwise_is_no_emulator(tmp_path: Path, described: Object) -> None:
    control = RequestDispatcher({"describe": (lambda request: described, ())})
    told = pytest.raises(Refused, match="ctl: no emulator: what it describes is none")
    with served(tmp_path / "ctl", control) as place, told:
        open_stimulus(place)
