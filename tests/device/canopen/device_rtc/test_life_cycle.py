"""M1 to M11 of the merged state machine, with every result of a callback (NEDO, Fig. 110)."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.device.canopen.device_rtc.bench import CALLBACKS, COMMANDS, RtcBench

GOLDEN = Path(__file__).parents[3] / "golden" / "rtc_canopen.json"
STATES = ("Created", "Inactive", "Active", "Error", "Finalized")
STIMULI = (*COMMANDS, "shut down")
HEARTBEATS = {"Inactive": "710#7F", "Active": "710#05", "Error": "710#04"}
BOOT_UP, PDO = ["710#00"], ["190#0000"]
ABORTED = "on_deactivated on_aborting"

Row = tuple[str, list[str], str]
"""Callbacks in their order, frames of the tick, state afterwards."""

# What is not here does nothing.
WELL: dict[tuple[str, str], Row] = {
    ("Inactive", "start"): ("on_activated", PDO, "Active"),  # M2
    ("Active", "enter pre-operational"): ("on_deactivated", [], "Inactive"),  # M3
    ("Inactive", "stop"): ("", [], "Error"),  # M4, K7
    ("Active", "stop"): (ABORTED, [], "Error"),  # M7, K6
    ("Error", "reset node"): ("on_reset", BOOT_UP, "Inactive"),  # M8, M10
    ("Error", "reset communication"): ("on_reset", BOOT_UP, "Inactive"),  # M9, M10, K8
    ("Inactive", "shut down"): ("on_finalize", [], "Finalized"),  # M11
    ("Active", "shut down"): ("on_deactivated on_finalize", [], "Finalized"),
    ("Error", "shut down"): ("on_finalize", [], "Finalized"),
    ("Inactive", "reset node"): ("on_finalize on_initialize", BOOT_UP, "Inactive"),  # K10
    ("Inactive", "reset communication"): ("", BOOT_UP, "Inactive"),
    ("Active", "reset node"): (*("on_deactivated on_finalize on_initialize", BOOT_UP, "Inactive"),),
    ("Active", "reset communication"): ("on_deactivated", BOOT_UP, "Inactive"),
    ("Created", "reset node"): ("on_initialize", BOOT_UP, "Inactive"),  # K11
}
STRICT: dict[tuple[str, str], Row] = {
    **WELL,
    ("Error", "start"): ("on_reset on_activated", PDO, "Active"),  # K9
    ("Error", "enter pre-operational"): ("on_reset", [], "Inactive"),
}
# The third word is the callback that fails.
FAILED: dict[tuple[str, str, str], Row] = {
    ("Inactive", "start", "on_activated"): (f"on_activated {ABORTED}", [], "Error"),
    ("Active", "enter pre-operational", "on_deactivated"): (ABORTED, [], "Error"),
    ("Error", "reset node", "on_reset"): ("on_reset", [], "Error"),
    ("Error", "reset communication", "on_reset"): ("on_reset", [], "Error"),
    ("Inactive", "reset node", "on_initialize"): ("on_finalize on_initialize", [], "Created"),
    ("Active", "reset node", "on_initialize"): (
        *("on_deactivated on_finalize on_initialize", [], "Created"),
    ),
    ("Created", "reset node", "on_initialize"): ("on_initialize", [], "Created"),
}
FAILED_STRICT: dict[tuple[str, str, str], Row] = {
    **FAILED,
    ("Error", "start", "on_reset"): ("on_reset", [], "Error"),
    ("Error", "start", "on_activated"): (f"on_reset on_activated {ABORTED}", [], "Error"),
    ("Error", "enter pre-operational", "on_reset"): ("on_reset", [], "Error"),
}


def check(bench: RtcBench, stimulus: str, row: Row) -> None:
    called, sent, state = row
    assert bench.act(stimulus) == sent
    assert bench.called == called.split()
    assert bench.state == state
    bench.failing.clear()
    assert bench.heartbeat() == HEARTBEATS.get(state, "")


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("stimulus", STIMULI)
def test_a_stimulus_does_what_its_row_says_or_nothing(
    stimulus: str, state: str, strict: bool
) -> None:
    rows = STRICT if strict else WELL
    bench = RtcBench(strict=strict).enter(state)
    check(bench, stimulus, rows.get((state, stimulus), ("", [], state)))


@pytest.mark.parametrize("strict", [False, pytest.param(True, marks=pytest.mark.unmeasured)])
@pytest.mark.parametrize("failing", CALLBACKS)
@pytest.mark.parametrize(("state", "stimulus"), STRICT)
def test_a_failing_callback_leads_where_its_row_says_or_does_not_matter(
    state: str, stimulus: str, failing: str, strict: bool
) -> None:
    rows, failed = (STRICT, FAILED_STRICT) if strict else (WELL, FAILED)
    bench = RtcBench(strict=strict).enter(state)
    bench.failing.add(failing)
    well = rows.get((state, stimulus), ("", [], state))
    check(bench, stimulus, failed.get((state, stimulus, failing), well))


@pytest.mark.parametrize(
    ("state", "failing", "called", "after"),
    [
        ("Inactive", "error_check", "error_check", "Error"),  # M5, K7
        ("Active", "on_execute", f"on_execute {ABORTED}", "Error"),  # M6, K6
        ("Error", "on_error", "on_error", "Error"),
    ],
)
def test_an_error_of_what_a_state_does_leads_to_error(
    state: str, failing: str, called: str, after: str
) -> None:
    bench = RtcBench().enter(state)
    bench.failing.add(failing)
    bench.run(10)
    assert (bench.called, bench.state) == (called.split(), after)
    assert bench.heartbeat() == HEARTBEATS[after]


def test_a_component_whose_initialization_fails_is_silent() -> None:
    bench = RtcBench()
    bench.failing.add("on_initialize")
    assert bench.run(300) == []
    assert (bench.called, bench.state) == (["on_initialize"], "Created")
    assert bench.step("610#4000100000000000") == []


def test_after_power_on_on_initialize_then_boot_up() -> None:
    bench = RtcBench()
    assert (bench.step(), bench.called, bench.state) == (BOOT_UP, ["on_initialize"], "Inactive")


def test_the_walk_through_the_life_cycle_is_that_of_the_vector() -> None:
    rows = json.loads(GOLDEN.read_text("utf-8"))["lifecycle_walk"]
    bench, sent = RtcBench(), list[str]()
    for row in (f"{row['id']}#{row['data'].replace(' ', '')}" for row in rows):
        if row.startswith("000#"):
            sent = bench.step(row)
        else:
            said = [text for text in sent or bench.run(100) if text.startswith("710#")]
            assert said == [row]
            sent = []
    assert bench.state == "Inactive"


def test_the_commands_of_the_vector_lead_where_their_rows_say() -> None:
    rows = json.loads(GOLDEN.read_text("utf-8"))["nmt"]
    said = []
    for row in rows:
        bench = RtcBench().enter("Active" if row["data"].startswith("80") else "Inactive")
        sent = bench.step(f"{row['id']}#{row['data'].replace(' ', '')}")
        said.append((row["note"], sent, bench.state))
    assert said == [
        ("start all", PDO, "Active"),
        ("stop node 16", [], "Error"),
        ("enter pre-operational node 16", [], "Inactive"),
        ("reset node 16", BOOT_UP, "Inactive"),
        ("reset communication node 16", BOOT_UP, "Inactive"),
    ]


@pytest.mark.parametrize("state", ["Inactive", "Active", "Error"])
def test_a_command_to_all_nodes_acts_by_the_state_of_each(state: str) -> None:
    bench = RtcBench().enter(state)
    bench.step("000#0100")
    assert bench.state == {"Inactive": "Active"}.get(state, state)


@pytest.mark.parametrize("frame", ["000#0111", "000#05", "000#0510", "000#011000"])
def test_what_is_no_command_for_this_node_is_ignored(frame: str) -> None:
    bench = RtcBench().enter("Inactive")
    bench.step(frame)
    assert (bench.called, bench.state) == ([], "Inactive")


def test_a_power_cut_calls_nothing_and_begins_anew() -> None:
    bench = RtcBench().enter("Active")
    bench.slave.reset()
    assert (bench.step(), bench.called) == (BOOT_UP, ["on_initialize"])


def test_a_power_cut_brings_a_finalized_node_back() -> None:
    bench = RtcBench().enter("Finalized")
    bench.rtc.inputs.set("shut_down", 0)
    assert (bench.run(300), bench.called) == ([], [])
    bench.slave.reset()
    assert bench.step() == BOOT_UP


def test_error_behaviour_runs_the_callbacks_of_the_change() -> None:
    bench = RtcBench().enter("Active")
    bench.slave.communication_error()  # 1029h:01 is 0: Pre-operational
    bench.step()
    assert (bench.called, bench.state) == (["on_deactivated"], "Inactive")


def test_a_node_without_node_id_initializes_when_lss_has_given_it_one() -> None:
    bench = RtcBench()
    bench.slave.configured_id = bench.slave.node_id = 0xFF
    assert (bench.step(), bench.called, bench.state) == ([], [], "Created")
    bench.step("7E5#0401000000000000")  # configuration
    assert bench.step("7E5#1110000000000000") == ["7E4#1100000000000000"]
    assert bench.step("7E5#0400000000000000") == BOOT_UP
    assert (bench.called, bench.state) == (["on_initialize"], "Inactive")


@pytest.mark.parametrize("command", ["reset node", "reset communication"])
def test_reset_out_of_error_keeps_the_component_and_a_later_reset_node_makes_a_new_one(
    command: str,
) -> None:
    bench = RtcBench().enter("Error")
    before = bench.rtc.life.component
    bench.act(command)
    assert bench.rtc.life.component is before
    bench.act("reset node")
    assert bench.rtc.life.component is not before


def test_reset_node_restores_the_ports_and_reset_communication_does_not() -> None:
    bench = RtcBench().enter("Active")
    bench.step("210#2A00")
    bench.act("reset communication")
    assert bench.rtc.read("in.inlet") == 42
    bench.act("reset node")
    assert bench.rtc.read("in.inlet") == 0
