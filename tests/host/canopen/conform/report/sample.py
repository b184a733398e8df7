"""Reports of runs that never were, for all that a report may have to show."""

from __future__ import annotations

from tickrig.host.canopen.conform.check import Check, Level
from tickrig.host.canopen.conform.verdict import (
    CheckOutcome,
    CheckVerdict,
    Direction,
    FrameLine,
    Report,
    Result,
)

HOSTILE = "<script>alert('1')</script>]]>&amp;\"\x1b[2J\n\x00\ud800\u202eFAIL all"

EVIDENCE = (
    FrameLine(1_000_000, Direction.SENT, "605#4001200000000000"),
    FrameLine(1_001_250, Direction.RECEIVED, "585#4B01200034120000"),
    FrameLine(1_001_300, Direction.REMARK, "power cycle"),
    FrameLine(1_002_000, Direction.SENT, "705#R1"),
    FrameLine(1_003_000, Direction.RECEIVED, "0000017F#"),
)


def result(
    name: str,
    verdict: CheckVerdict = CheckVerdict.PASS,
    reason: str = "",
    *,
    first: CheckOutcome | None = None,
    evidence: tuple[FrameLine, ...] = EVIDENCE,
) -> Result:
    group = name.partition("-")[0]
    check = Check(
        id=name,
        group=group,
        title=f"what {name} wants",
        source=f"CiA 301 v4.2, 7.2.{len(group)}.{name[-1]}",
        level=Level.COMMUNICATION,
        needs=frozenset({"store", "hbcons"}),
        steps=(),
    )
    return Result(check, CheckOutcome(verdict, reason, evidence, 1_000_000, 1_004_000), first)


SAMPLE = Report(
    source="can0",
    node_id=5,
    level=Level.COMMUNICATION,
    results=(
        result("NMT-01"),
        result("NMT-11", CheckVerdict.FAIL, "got 585#4B01200034120000, want 585#4B0120000000...."),
        result("HB-10", CheckVerdict.INCONCLUSIVE, "this host was 80 ms late"),
        result("HB-12", CheckVerdict.NOT_APPLICABLE, "1016h is not there", evidence=()),
        result("HB-13", CheckVerdict.NOT_APPLICABLE, "1016h is not there", evidence=()),
        result("US-08", CheckVerdict.IMPLEMENTATION_DEFINED, "no time-out within 5 s"),
        result(
            "PR-03",
            CheckVerdict.BLOCKED,
            "no boot-up within 5 s",
            first=CheckOutcome(CheckVerdict.FAIL, "?"),
        ),
        result("LS-02"),
    ),
    node={"1008h device name": HOSTILE, "1000h device type": "F0191h"},
    settings={"adapter": "socketcan", "bit rate": "500000 bit/s", "tolerance": "5 ms"},
    findings=("1800h: the EDS says 5 entries, the node 6",),
    unrestored=("1017h: 100 was written, 0 is to be written back",),
    duration_us=12_345_678,
)
