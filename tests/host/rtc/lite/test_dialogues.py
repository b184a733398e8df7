"""The golden dialogues (tests/golden/rtc_lite.json), held by the proxy with a node, to the byte.

L03 and L05 to L07 begin where they can through a proxy. A proxy never says
what L09, L11 and L12 say; what it makes of the answers is in test_callbacks.py.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.device.rtc_lite.bench import Recorder
from tests.host.rtc.lite.bench import PERIOD_US, Bench
from tests.wire.rtc_lite.vectors import VECTORS, raw
from tickrig.host.rtc import OutPort, connect
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_types.rtc import Time, TimedLong

DIALOGUES = {row["id"]: row for row in VECTORS["dialogues"]}


class Stage:
    """A proxy of a recorder, run period by period."""

    def __init__(self, state: str = "Inactive", *failing: str) -> None:
        self.bench = Bench(Recorder)
        self.link = self.bench.links[0]
        self.proxy = self.bench.attach(0, "Echo")
        if state == "Created":
            return
        self.bench.context.start()
        self.bench.run_to(PERIOD_US + PERIOD_US // 2)
        if state != "Inactive":
            self.activate()
        if state == "Error":
            self.bench.context.abort_component(self.proxy)
            self.period()
        component = self.bench.nodes[0].component
        assert isinstance(component, Recorder)
        component.failing |= set(failing)
        self.forget()

    def forget(self) -> None:
        self.link.sent.clear()
        self.link.heard = b""

    def period(self) -> None:
        self.bench.run_for(PERIOD_US)

    def activate(self) -> None:
        self.bench.manager.activate("Echo0")
        self.period()

    def said(self) -> tuple[bytes, bytes]:
        """Return all that was sent and heard, but for the optional on_startup."""
        sent = [data for _, data in self.link.sent if data[1:3] != LiteCommand.STARTUP.value]
        return b"".join(sent), self.link.heard


def start_up() -> Stage:
    return Stage("Created")


def pass_a_value_on() -> Stage:
    stage = Stage()
    out = OutPort("out", TimedLong)
    connect(out, stage.proxy.ports["in"])
    out.write(TimedLong(Time(), 42))
    stage.activate()
    stage.period()
    stage.bench.manager.deactivate("Echo0")
    stage.period()
    return stage


def fail_to_execute() -> Stage:
    stage = Stage("Active", "on_execute")
    stage.period()
    stage.period()
    stage.bench.manager.reset("Echo0")
    stage.period()
    return stage


def fail_to_activate() -> Stage:
    stage = Stage("Inactive", "on_activated")
    stage.proxy.on_activated(stage.bench.context)
    return stage


def execute_what_is_not_active() -> Stage:
    stage = Stage()
    stage.proxy.on_execute(stage.bench.context)
    return stage


def finalize() -> Stage:
    stage = Stage()
    stage.proxy.on_finalize()
    return stage


def abort() -> Stage:
    stage = Stage("Active")
    stage.proxy.on_aborting(stage.bench.context)
    stage.proxy.on_error(stage.bench.context)
    return stage


def fail_to_deactivate() -> Stage:
    stage = Stage("Active", "on_deactivated")
    stage.proxy.on_deactivated(stage.bench.context)
    return stage


@pytest.mark.parametrize(
    ("dialogue", "play"),
    [
        ("L01", start_up),
        ("L02", pass_a_value_on),
        ("L03", execute_what_is_not_active),
        ("L04", fail_to_execute),
        ("L06", fail_to_activate),
        ("L10", finalize),
        ("L13", abort),
        ("L14", fail_to_deactivate),
    ],
)
def test_a_proxy_says_and_hears_what_the_dialogue_says(
    dialogue: str, play: Callable[[], Stage]
) -> None:
    steps = DIALOGUES[dialogue]["steps"]
    said = raw(*(step["proxy"] for step in steps))
    heard = raw(*(frame for step in steps for frame in step["device"]))
    assert play().said() == (said, heard)


def test_a_reset_that_fails_leaves_both_in_error() -> None:
    """The first step of L05; the proxy asks for the state only if nobody knows it."""
    stage = Stage("Active", "on_execute", "on_reset")
    stage.period()
    stage.period()
    stage.forget()
    stage.bench.manager.reset("Echo0")
    stage.period()
    step = DIALOGUES["L05"]["steps"][0]
    assert stage.said()[0].startswith(raw(step["proxy"]))
    assert stage.said()[1].startswith(raw(*step["device"]))
    assert stage.bench.states() == {"Echo0": "ERROR"}


def test_pings_are_numbered_1_to_255_and_answered() -> None:
    """L08: 1, 2 and 255; then 1 again."""
    stage = Stage()
    stage.bench.run_for(257 * 1_010_000)
    pings = [data for _, data in stage.link.sent if data[1:3] == b"CY"]
    first, second, last = (raw(step["proxy"]) for step in DIALOGUES["L08"]["steps"])
    assert (pings[0], pings[1], pings[254], pings[255]) == (first, second, last, first)
    for step in DIALOGUES["L08"]["steps"]:
        assert raw(*step["device"]) in stage.link.heard
    assert stage.bench.events == []
