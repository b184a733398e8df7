"""Operations on a proxy and the frames they make (K14)."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.host.rtc.canopen.bench import Bench
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.events import ServerEventType

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE
GOLDEN = Path(__file__).parents[4] / "golden" / "rtc_canopen.json"
PALETTE = "nodes: [{id: 16, name: Palette0, eds: f-palette.eds, role: device}]\n"


def booted(text: str = PALETTE) -> Bench:
    bench = Bench(text, {16: "f-palette"})
    bench.boot()
    bench.run_ms(120)
    return bench


def abort(bench: Bench) -> None:
    manager = bench.server.manager
    manager.context_of("Palette0").abort_component(manager.find("Palette0"))


def test_the_walk_through_the_life_cycle_makes_the_frames_of_the_report() -> None:
    bench = booted()
    bench.activate(16)
    abort(bench)
    bench.run_ms(200)
    bench.server.manager.reset("Palette0")
    bench.run_ms(200)
    walk = json.loads(GOLDEN.read_text("utf-8"))["lifecycle_walk"]
    wanted = [f"{frame['id']}#{frame['data'].replace(' ', '')}" for frame in walk]
    seen = [str(heard) for _, heard in bench.log.heard]
    seen = [text for text in seen if text.startswith(("710#", "000#"))]
    assert [text for place, text in enumerate(seen) if text != seen[place - 1]] == wanted


def test_activation_is_confirmed_by_the_heartbeat() -> None:
    bench = booted()
    bench.server.manager.activate("Palette0")
    bench.run_ms(12)
    proxy = bench.proxy(16)
    assert proxy is not None
    assert (proxy.state, proxy.confirmed) == (ACTIVE, False)
    bench.run_ms(110)
    assert proxy.confirmed


def test_a_device_that_ignores_the_start_is_told_of_as_not_confirmed() -> None:
    bench = booted()
    bench.devices[16].slave.on_state.append(
        lambda old, new: bench.devices[16].slave.enter(old) if new == 5 else None
    )
    bench.server.manager.activate("Palette0")
    event = bench.run_until(ServerEventType.NOT_CONFIRMED, 16)
    assert event.text == "OPERATIONAL was not reported"
    bench.run_ms(200)
    assert bench.state(16) is ERROR
    assert bench.devices[16].read("state") == "Stopped"


@pytest.mark.parametrize(("heartbeat_ms", "wait_ms"), [(50, 300), (100, 300), (200, 600)])
def test_a_state_is_waited_for_three_heartbeat_times_at_least_300_ms(
    heartbeat_ms: int, wait_ms: int
) -> None:
    bench = booted(PALETTE.replace("device}", f"device, heartbeat_ms: {heartbeat_ms}}}"))
    node = bench.devices[16].slave
    node.on_state.append(lambda old, new: node.enter(old) if new == 5 else None)
    bench.server.manager.activate("Palette0")
    event = bench.run_until(ServerEventType.NOT_CONFIRMED, 16)
    (requested_us,) = [at for at, heard in bench.log.heard if str(heard) == "000#0110"]
    assert wait_ms * 1_000 - 100 <= event.at_us - requested_us <= wait_ms * 1_000


def test_deactivation_right_after_activation_reaches_the_device() -> None:
    bench = booted()
    bench.server.manager.activate("Palette0")
    bench.run_ms(12)
    bench.server.manager.deactivate("Palette0")
    bench.run_ms(200)
    assert bench.state(16) is INACTIVE
    assert bench.devices[16].read("state") == "Pre-operational"


def test_a_reset_to_which_no_boot_up_comes_leaves_the_proxy_in_error() -> None:
    bench = booted(PALETTE + "master: {remove_ms: 60000}\n")
    abort(bench)
    bench.run_ms(200)
    bench.devices[16].physical["unplugged"].write(1)
    bench.server.manager.reset("Palette0")
    bench.run_ms(500)
    assert bench.state(16) is ERROR
    bench.devices[16].physical["unplugged"].write(0)
    bench.run_ms(200)
    bench.server.manager.reset("Palette0")
    bench.run_ms(300)
    assert bench.state(16) is INACTIVE


def test_the_server_is_a_node_with_a_heartbeat_of_its_own() -> None:
    bench = booted(PALETTE + "master: {node: 126, heartbeat_ms: 50}\n")
    bench.run_ms(200)
    own = [(at, str(heard)) for at, heard in bench.log.heard if str(heard).startswith("77E#")]
    assert [text for _, text in own][:3] == ["77E#00", "77E#05", "77E#05"]
    assert abs(own[2][0] - own[1][0] - 50_000) < 200


def test_two_runs_are_the_same_to_the_byte() -> None:
    logs = []
    for _ in range(2):
        bench = booted()
        bench.activate(16)
        logs.append(bench.log.lines)
    assert logs[0] == logs[1]
