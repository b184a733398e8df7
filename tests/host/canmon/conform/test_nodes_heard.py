from __future__ import annotations

import pytest

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.host.canmon.conform.nodes_heard import nodes_heard
from tickrig.wire.can import CanFrame


def test_nodes_are_known_by_what_slaves_send() -> None:
    rig, wire = Rig(), CanWire()
    link, others = CanHost(rig, wire.end()), wire.end()
    texts = ("705#7F", "705#7F", "190#00", "583#60", "603#40", "000#0107", "7E4#50", "080#")
    others.send(0, tuple(map(CanFrame.parse, texts)))
    assert nodes_heard(link, 100_000) == {3: 1, 5: 2, 16: 1}
    assert link.now_us == pytest.approx(100_000, abs=1_000)
