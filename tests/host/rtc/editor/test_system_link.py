"""The thread that asks a running system for its state."""

from __future__ import annotations

import threading
from pathlib import Path

from tickrig.host.rtc.editor.system_link import SystemLink


def test_a_link_that_is_closed_while_requests_wait_ends_its_thread(tmp_path: Path) -> None:
    link = SystemLink(tmp_path / "nothing")
    link.request("activate", name="Odometry0")
    link.close()
    before = set(threading.enumerate())
    link.start()
    for thread in set(threading.enumerate()) - before:
        thread.join(10)
        assert not thread.is_alive()
    assert link.problem
