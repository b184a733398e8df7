"""What a report says of how the run judged: for people, by name."""

from __future__ import annotations

from collections.abc import Collection

from tickrig.host.canopen.conform.bus.exchange import HOST_GAP_US
from tickrig.host.canopen.conform.bus.periods import MS_US, PERIOD_TOLERANCE
from tickrig.host.canopen.conform.bus.traffic import ASSUMED_BIT_RATE
from tickrig.host.canopen.conform.notation.step_text import ANSWER_MS
from tickrig.host.canopen.conform.plan import Plan


def describe_settings(plan: Plan, others: Collection[int]) -> dict[str, str]:
    """Return bit rate, limits and tolerances of a run.

    Args:
        plan: what was chosen.
        others: node-IDs that were on the bus.
    """
    rate = f"{plan.bit_rate} bit/s" if plan.bit_rate else f"{ASSUMED_BIT_RATE} bit/s, assumed"
    nodes = ", ".join(str(node) for node in sorted(set(others) - {0})) or "none"
    return {
        "bit rate": rate,
        "load by the tester": f"at most {plan.max_load:.0%}",
        "other nodes": nodes,
        "resolution of time stamps": f"{plan.resolution_us / MS_US:g} ms",
        "answers": f"within {ANSWER_MS} ms, where the check says nothing else",
        "periods": f"mean within {PERIOD_TOLERANCE:.0%}",
        "late host": f"{HOST_GAP_US / MS_US:g} ms make a failure inconclusive",
        "longest run": f"{plan.longest_s / 60:g} min, then all is blocked; 2 min more to restore",
        "seed": str(plan.seed),
    }
