from __future__ import annotations

from dataclasses import dataclass

import pytest

from tests.hil.rrc.bench import sim_bench
from tests.hil.rrc.lateness import EmulatorPace, PacedLink, too_slow
from tests.hil.rrc.verdict import judge


class Stumbling:
    """A link whose waits take as much longer as they are told."""

    def __init__(self) -> None:
        self.now_us, self.late_us, self.waits = 0, 0, list[int]()
        self.data = b""

    def send(self, traffic: bytes, /) -> None:
        pass

    def receive(self, timeout_us: int, /) -> bytes:
        self.waits.append(timeout_us)
        self.now_us += self.late_us + (0 if self.data else timeout_us)
        return self.data

    def close(self) -> None:
        pass


@dataclass
class Late:
    late_us: int


def test_a_host_that_keeps_up_is_not_late() -> None:
    link = Stumbling()
    paced = PacedLink(link)
    assert paced.receive(25_000) == b""
    assert (link.waits, link.now_us, paced.late_us) == ([10_000, 10_000, 5_000], 25_000, 0)
    link.data = b"x"
    assert (paced.receive(25_000), link.now_us, paced.late_us) == (b"x", 25_000, 0)


def test_a_wait_that_took_longer_was_late() -> None:
    link = Stumbling()
    paced = PacedLink(link)
    link.late_us = 7_000
    paced.receive(10_000)
    assert paced.late_us == 7_000


def test_bytes_that_came_in_time_and_were_taken_late_were_late() -> None:
    link = Stumbling()
    paced = PacedLink(link)
    link.data, link.late_us = b"x", 60_000
    paced.receive(100_000)
    assert paced.late_us == 50_000  # how much of it was waiting for the byte nobody knows


def test_a_pause_between_two_calls_was_late() -> None:
    link = Stumbling()
    paced = PacedLink(link)
    paced.receive(0)
    link.now_us += 30_000
    paced.receive(0)
    assert paced.late_us == 30_000


def test_an_emulator_may_take_a_period_for_its_answer() -> None:
    link = Stumbling()
    paced = PacedLink(link)

    def ask(do: str) -> dict[str, object]:
        link.now_us += took_us
        return {}

    took_us = 10_000
    paced.beside(ask)("status")
    assert paced.late_us == 0
    took_us = 24_000
    paced.beside(ask)("status")
    assert paced.late_us == 14_000


def test_an_emulator_that_was_late_before_is_late_when_it_is_so_again() -> None:
    status = {"late_steps": 3, "late_us": 40_000}
    pace = EmulatorPace(lambda do: status)
    assert pace.late_us == 0
    status["late_steps"] += 1
    assert pace.late_us == 40_000


@pytest.mark.parametrize(
    ("error", "late_us"), [(TimeoutError(), 5_000_000), (ConnectionResetError(), 0)]
)
def test_an_emulator_that_does_not_answer_is_late_and_one_that_is_gone_is_not(
    error: OSError, late_us: int
) -> None:
    def ask(do: str) -> dict[str, object]:
        if asked:
            raise error
        asked.append(do)
        return {"late_steps": 0, "late_us": 0}

    asked = list[str]()
    assert EmulatorPace(ask).late_us == late_us


def test_a_bench_that_is_closed_knows_how_late_it_was() -> None:
    with sim_bench() as bench:
        bench.parts = {"host": Late(80_000)}
        bench.close()
    assert bench.look() == "the machine was too slow: host up to 80 ms late"


def test_what_a_human_has_denied_is_a_failure_on_any_machine() -> None:
    with sim_bench() as bench:
        bench.parts = {"host": Late(80_000)}
        bench.operator.said_no = True
        report = failed()
        judge(report, bench)
    assert report.when == "call"


def test_virtual_time_is_never_late() -> None:
    with sim_bench() as bench:
        assert too_slow(bench.parts) == ""


def failed(when: str = "call") -> pytest.TestReport:
    with pytest.raises(AssertionError) as caught:
        raise AssertionError("the motors run")
    place = ("tests/hil/rrc/test_safety.py", 1, "test_it")
    return pytest.TestReport("test_it", place, {}, "failed", caught.getrepr(), when)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("late_us", "category"), [(0, "failed"), (5_000, "failed"), (5_001, "error"), (80_000, "error")]
)
def test_a_failure_on_a_machine_that_was_late_is_an_error(
    late_us: int, category: str, pytestconfig: pytest.Config
) -> None:
    report = failed()
    with sim_bench() as bench:
        bench.parts = {"host": Late(1_000), "emulator": Late(late_us)}
        judge(report, bench)
    status = pytestconfig.hook.pytest_report_teststatus(report=report, config=pytestconfig)
    assert status[0] == category
    crash = report.longrepr.reprcrash.message  # type: ignore[union-attr]  # as pytest sums up
    assert ("the machine was too slow" in crash) == (category == "error")
    assert "the motors run" in crash


def test_a_failure_of_a_few_words_is_an_error_too() -> None:
    report = failed()
    report.longrepr = "the motors run"
    with sim_bench() as bench:
        bench.parts = {"host": Late(80_000)}
        judge(report, bench)
    assert report.longrepr == ("the machine was too slow: host up to 80 ms late\nthe motors run")


def test_the_reason_says_who_was_late() -> None:
    assert too_slow({"host": Late(1_000), "emulator": Late(57_400)}) == (
        "the machine was too slow: host up to 1 ms, emulator up to 57 ms late"
    )


def test_what_passed_or_had_no_bench_is_left_alone(pytestconfig: pytest.Config) -> None:
    report = failed()
    judge(report, None)
    assert report.when == "call"
    with sim_bench() as bench:
        bench.parts = {"host": Late(80_000)}
        report = failed("teardown")
        judge(report, bench)
    assert report.when == "teardown"
