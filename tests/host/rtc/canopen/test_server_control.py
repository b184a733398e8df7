"""What can be asked of a running server over its control socket, in virtual time."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import Bench
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.commands.opening import ServerControl
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.serve import ServerRunner
from tickrig.host.rtc.canopen.served_node import NodePhase

ACTIVE = LifeCycleState.ACTIVE


def controlled(*active: int) -> tuple[Bench, ServerRunner, ServerControl]:
    bench = Bench()
    bench.boot()
    bench.run_ms(20)
    if active:
        bench.activate(*active)
    runner = ServerRunner(bench.server, bench.link)
    return bench, runner, ServerControl(bench.server, runner, "virtual x")


def ask(control: ServerControl, do: str, **fields: object) -> dict[str, Any]:
    return control.answer({"v": 1, "do": do, **fields})


def test_status_tells_of_each_node() -> None:
    bench, _, control = controlled(16)
    answer = ask(control, "status")
    ages = [node.pop("heartbeat_age_us") for node in answer["nodes"]]
    assert all(0 <= age <= 100_000 for age in ages)
    assert answer == {
        **{"v": 1, "ok": True, "link": "virtual x", "components": 2},
        **{"now_us": bench.server.manager.now_us, "late_ticks": 0, "late_us": 0},
        "nodes": [
            {
                **{"node": 16, "name": "Palette0", "phase": "ready", "problem": ""},
                **{"nmt_state": "OPERATIONAL", "proxy_state": "ACTIVE"},
            },
            {
                **{"node": 32, "name": "Motor0", "phase": "ready", "problem": ""},
                **{"nmt_state": "PRE_OPERATIONAL", "proxy_state": "INACTIVE"},
            },
        ],
    }


def test_a_node_that_was_never_heard_has_no_age() -> None:
    bench = Bench(models={16: "f-palette"})
    control = ServerControl(bench.server, ServerRunner(bench.server, bench.link), "x")
    bench.run_ms(500)
    node = ask(control, "status")["nodes"][1]
    assert (node["heartbeat_age_us"], node["phase"], node["proxy_state"]) == (None, "absent", "")


@pytest.mark.parametrize("away_ms", [600, 2_000])
def test_a_node_that_was_lost_is_restarted_by_hand_and_active_again(away_ms: int) -> None:
    bench, _, control = controlled(16, 32)
    bench.devices[16].physical["unplugged"].write(1)
    bench.run_ms(away_ms)
    bench.devices[16].physical["unplugged"].write(0)
    bench.run_ms(800)
    assert bench.state(16) is not ACTIVE
    assert ask(control, "restart", node=16)["ok"]
    bench.run_ms(800)
    assert bench.events(ServerEventType.RESTARTED) == ["Restarted 16 by hand"]
    assert bench.state(16) is (ACTIVE if away_ms == 600 else LifeCycleState.INACTIVE)
    assert not bench.events(ServerEventType.DUPLICATE_NODE, ServerEventType.DUPLICATE_SUSPECTED)


def test_a_node_that_works_is_reset_and_works_again() -> None:
    bench, _, control = controlled(16, 32)
    before = bench.proxy(16)
    ask(control, "restart", node=16)
    bench.run_ms(800)
    assert frames("000#8110")[0] in [heard for _, heard in bench.log.heard]
    assert bench.proxy(16) is not before
    assert (bench.state(16), bench.state(32)) == (ACTIVE, ACTIVE)


def test_a_node_that_is_away_is_looked_for_until_it_is_there() -> None:
    bench, _, control = controlled(16)
    bench.devices[16].physical["power_off"].write(1)
    bench.run_ms(500)
    ask(control, "restart", node=16)
    bench.run_ms(3_000)
    assert bench.server.nodes[16].phase is NodePhase.ABSENT
    bench.devices[16].physical["power_off"].write(0)
    bench.run_ms(1_500)
    assert bench.state(16) is ACTIVE


def test_a_node_that_was_refused_is_set_up_again() -> None:
    bench, _, control = controlled()
    bench.server.nodes[16].refuse("nobody knows why")
    ask(control, "restart", node=16)
    bench.run_ms(800)
    assert bench.server.nodes[16].phase is NodePhase.READY


def test_requests_of_a_system_are_answered_and_all_nodes_started() -> None:
    bench, _, control = controlled()
    ask(control, "activate", name="Motor0")
    bench.run_ms(400)
    assert (bench.state(16), bench.state(32)) == (LifeCycleState.INACTIVE, ACTIVE)
    ask(control, "start")
    bench.run_ms(400)
    assert bench.state(16) is ACTIVE
    names = [one["name"] for one in ask(control, "describe")["components"]]
    assert names == ["Palette0", "Motor0"]


@pytest.mark.parametrize(
    ("do", "fields", "error"),
    [
        ("restart", {"node": 5}, "node 5 is not one of: 16, 32"),
        ("restart", {"node": "16"}, 'node is a whole number, not "16"'),
        ("restart", {"node": 128}, "node 128 is not in 1..127"),
        ("delete", {"name": "Palette0"}, 'no request "delete"; known: describe, connect'),
    ],
)
def test_what_cannot_be_is_refused(do: str, fields: dict[str, object], error: str) -> None:
    _, _, control = controlled()
    answer = ask(control, do, **fields)
    assert not answer["ok"]
    assert answer["error"].startswith(error)


def test_the_runner_serves_between_ticks_until_it_is_stopped() -> None:
    bench, runner, control = controlled()
    served: list[int] = []

    def serve(wait_us: int) -> None:
        served.append(bench.now_us)
        if len(served) == 10:
            ask(control, "stop")

    ticks: list[int] = []
    runner.serve = serve
    runner.after_tick.append(ticks.append)
    runner.run()
    pauses = [after - before for before, after in pairwise(served)]
    assert len(served) == len(ticks) == 10
    assert max(pauses) <= 20_000
    runner = ServerRunner(bench.server, bench.link)
    runner.run(until_us := bench.now_us + 50_000)
    assert bench.now_us >= until_us
