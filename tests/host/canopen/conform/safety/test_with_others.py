"""Other nodes on the bus: what they answer fails nothing, and they stay as they are."""

from __future__ import annotations

from tests.host.canopen.conform.r1 import yes
from tests.host.canopen.conform.test_our_slaves import eds_of
from tests.host.canopen.conform.under_test import Judged, slave_of
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.verdict import CheckVerdict
from tickrig.wire.can import CanFrame


def test_lss_answers_of_other_nodes_fail_nothing_and_their_node_ids_stay() -> None:
    others = [slave_of("epos"), slave_of("motor-core-unit")]
    for other in others:
        other.dictionary[0x1017, 0].assign((100).to_bytes(2, "little"))
    judged = Judged.of("f-palette", *others)
    ids = [other.node_id for other in others]
    report = judged.judge(
        ConformancePlan(Level.INTRUSIVE, ("LS",), confirm=yes), eds_of("f-palette")
    )
    outcomes = {each.check.id: each.outcome for each in report.results}
    assert CheckVerdict.FAIL not in {outcome.verdict for outcome in outcomes.values()}
    known = ", ".join(map(str, sorted(ids)))
    assert outcomes["LS-02"].verdict is CheckVerdict.INCONCLUSIVE
    assert outcomes["LS-02"].reason.endswith(f"other nodes may have answered: {known}")
    assert outcomes["LS-04"].reason == f"other nodes would also execute LSS 11h: {known}"
    judged.link.send((CanFrame.parse("000#8200"),))
    judged.rig.run_for(100_000)
    assert [other.node_id for other in others] == ids
    assert judged.slave.node_id not in ids
