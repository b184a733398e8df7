"""How a command ends whose peers hang."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.live_system import has_components, live_system, start_system

pytestmark = [OMNIORB, pytest.mark.realtime]

ONE = '[[component]]\nname = "{}"\ntype = "{}"\nrate_hz = 100.0\nactive = true\n'


def test_a_peer_that_hangs_while_data_flow_does_not_hinder_the_end(tmp_path: Path) -> None:
    (tmp_path / "out.toml").write_text(ONE.format("Out0", "SeqOut"), "utf-8")
    (tmp_path / "in.toml").write_text(ONE.format("In0", "SeqIn"), "utf-8")
    (tmp_path / "peer").mkdir()
    with live_system(tmp_path, str(tmp_path / "out.toml")) as system:
        peer = start_system(system.names, tmp_path / "peer", str(tmp_path / "in.toml"))
        try:
            has_components(system, "Out0", "In0")
            assert system.tool("rtcon", "@/Out0.rtc:Long", "@/In0.rtc:Long") == (0, "", "")
            assert "Connected to" in system.tool("rtcat", "-l", "@/Out0.rtc:Long")[1]
            peer.process.send_signal(signal.SIGSTOP)
            os.waitid(os.P_PID, peer.process.pid, os.WSTOPPED)
            code, said = system.end()
            assert code == 0, said
            peer.process.kill()  # else rtls would hang
            assert "Out0.rtc" not in system.tool("rtls", "@")[1].split()
        finally:
            peer.process.kill()
            peer.process.communicate()
