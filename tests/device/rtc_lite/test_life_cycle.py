"""Every command in every state, with every result of its callback (digest, sections 2, 4 and 5)."""

from __future__ import annotations

import pytest

from tests.device.rtc_lite.bench import NodeBench
from tickrig.device.rtc_lite.component import LiteEcho

STATES = ("Created", "Inactive", "Active", "Error", "None")
COMMANDS = ("CI", "CF", "AA", "AD", "AE", "AB", "AC", "AR", "AS", "AH", "CX")

# command, state: callbacks and reply if all goes well; if the first callback fails; state then.
ABORTED = "on_deactivated on_aborting"
WELL = {
    ("CI", "Created"): ("on_initialize", "@I"),
    ("CF", "Inactive"): ("on_finalize", "@N"),
    ("AA", "Inactive"): ("on_activated", "@A"),
    ("AD", "Active"): ("on_deactivated", "@I"),
    ("AE", "Active"): ("on_execute", "@A"),
    ("AB", "Active"): (ABORTED, "@E"),
    ("AC", "Error"): ("on_error", "@E"),
    ("AR", "Error"): ("on_reset", "@I"),
    **{("AS", state): ("on_startup", f"@{state[0]}") for state in ("Inactive", "Active", "Error")},
    **{("AH", state): ("on_shutdown", f"@{state[0]}") for state in ("Inactive", "Active", "Error")},
    **{("CX", state): ("", f"@{state[0]}") for state in STATES},
}
FAILED = {
    ("CI", "Created"): ("on_initialize", "xC"),
    ("CF", "Inactive"): ("on_finalize", "xI"),
    ("AA", "Inactive"): (f"on_activated {ABORTED}", "xE"),
    ("AD", "Active"): (ABORTED, "xE"),
    ("AE", "Active"): (f"on_execute {ABORTED}", "xE"),
    ("AB", "Active"): (ABORTED, "@E"),
    ("AC", "Error"): ("on_error", "xE"),
    ("AR", "Error"): ("on_reset", "xE"),
    **{("AS", state): ("on_startup", f"x{state[0]}") for state in ("Inactive", "Active", "Error")},
    **{("AH", state): ("on_shutdown", f"x{state[0]}") for state in ("Inactive", "Active", "Error")},
}
ALL = [(command, state) for command in COMMANDS for state in STATES]


@pytest.mark.parametrize(("command", "state"), ALL)
def test_a_command_does_what_its_row_says_or_is_refused(command: str, state: str) -> None:
    bench = NodeBench().enter(state)
    called, reply = WELL.get((command, state), ("", f"H{state[0]}"))
    assert bench.ask(command) == command + reply
    assert bench.recorder.called == called.split()
    assert bench.state[0] == reply[-1]


@pytest.mark.parametrize(("command", "state"), list(FAILED))
def test_a_failing_callback_leads_where_its_row_says(command: str, state: str) -> None:
    bench = NodeBench().enter(state)
    called, reply = FAILED[command, state]
    bench.recorder.failing.add(called.split()[0])
    assert bench.ask(command) == command + reply
    assert bench.recorder.called == called.split()
    assert bench.state[0] == reply[-1]


def test_a_failing_on_aborting_changes_nothing() -> None:
    bench = NodeBench().enter("Active")
    bench.recorder.failing |= {"on_execute", "on_aborting"}
    assert bench.ask("AE") == "AExE"


@pytest.mark.parametrize("command", ["AS", "AH"])
def test_what_a_component_does_not_define_is_not_supported(command: str) -> None:
    bench = NodeBench(LiteEcho)
    bench.ask("CI")
    assert bench.ask(command) == f"{command}!"


def test_callbacks_of_an_empty_component_all_go_well() -> None:
    bench = NodeBench(LiteEcho)
    for request, reply in (
        *(("CI", "CI@I"), ("AA", "AA@A"), ("AE", "AE@A"), ("AB", "AB@E"), ("AC", "AC@E")),
        *(("AR", "AR@I"), ("AA", "AA@A"), ("AD", "AD@I"), ("CF", "CF@N"), ("CI", "CIHN")),
    ):
        assert bench.ask(request) == reply
