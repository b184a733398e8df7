from __future__ import annotations

import pytest

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.conform.stimulus import list_nodes, nodes_heard
from tickrig.wire.can import CanFrame


def test_nodes_are_known_by_what_slaves_send() -> None:
    rig, wire = Rig(), CanWire()
    link, others = CanHost(rig, wire.end()), wire.end()
    texts = ("705#7F", "705#7F", "190#00", "583#60", "603#40", "000#0107", "7E4#50", "080#")
    others.send(0, tuple(map(CanFrame.parse, texts)))
    assert nodes_heard(link, 100_000) == {3: 1, 5: 2, 16: 1}
    assert link.now_us == pytest.approx(100_000, abs=1_000)


@pytest.mark.parametrize(
    ("frames", "status", "out", "err"),
    [
        (("705#7F", "705#7F", "190#00"), 0, "node 5  2 frames\nnode 16  1 frame\n", ""),
        (("080#",), 5, "", "no frames within 1.5 s; a node that sends nothing itself is not"),
    ],
)
def test_who_is_heard_is_listed_for_programs(
    frames: tuple[str, ...], status: int, out: str, err: str, capsys: pytest.CaptureFixture[str]
) -> None:
    rig, wire = Rig(), CanWire()
    link, others = CanHost(rig, wire.end()), wire.end()
    others.send(0, tuple(map(CanFrame.parse, frames)))
    assert list_nodes(ConformSource(link, "can0", "a wire")) == status
    said = capsys.readouterr()
    assert said.out == out
    assert said.err.startswith(err)
