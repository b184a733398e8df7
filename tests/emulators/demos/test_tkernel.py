"""The demonstration of the node on T-Kernel, and its numbers."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from tickrig.emulators.commands.cli import main
from tickrig.emulators.demos.tkernel import CorridorStage, Estimate, Moment, run_demo
from tickrig.emulators.tkernel.node_manager import CONTENTS, SETTLEMENT

GOLDEN = Path(__file__).parents[2] / "golden" / "tkernel_demo.txt"


@pytest.fixture(scope="module")
def played() -> tuple[CorridorStage, list[Moment], str]:
    stage, lines = CorridorStage(), list[str]()
    moments = run_demo(stage, lines.append)
    return stage, moments, "".join(f"{line}\n" for line in lines)


def worst_m(moments: list[Moment], *, outage: bool) -> float:
    return max(moment.error_m for moment in moments if moment.outage is outage)


def test_the_robot_keeps_its_position_through_the_outage(
    played: tuple[CorridorStage, list[Moment], str],
) -> None:
    _, moments, _ = played
    assert max(moment.odometry_error_m for moment in moments) > 0.9
    assert worst_m(moments, outage=False) < 0.2
    assert worst_m(moments, outage=True) < 0.2
    assert sum(moment.outage for moment in moments) > 200


def test_it_is_the_caches_that_do_it(played: tuple[CorridorStage, list[Moment], str]) -> None:
    without = run_demo(CorridorStage(caches=False), lambda line: None)
    assert worst_m(without, outage=True) > 0.5
    _, moments, _ = played
    assert worst_m(without, outage=False) == worst_m(moments, outage=False)


def test_the_outage_is_seen_in_the_caches(played: tuple[CorridorStage, list[Moment], str]) -> None:
    stage, _, _ = played
    for name in (SETTLEMENT, CONTENTS):
        counts = stage.lookup(name).cache.counts
        assert counts.stale > 100
        assert counts.failures > 5
        assert counts.misses < 20
    assert stage.board.read("boots") == 1
    assert sum(stage.board.read(x) for x in stage.board.outputs if x.startswith("refused")) == 0


def test_its_lines_are_the_same_each_time(played: tuple[CorridorStage, list[Moment], str]) -> None:
    assert played[2] == GOLDEN.read_text("utf-8")


def test_the_command_shows_it() -> None:
    result = CliRunner().invoke(main, ["demo", "tkernel"])
    assert (result.exit_code, result.stdout) == (0, GOLDEN.read_text("utf-8"))


def test_an_estimate_is_as_far_from_a_marker_as_its_signal_says() -> None:
    estimate = Estimate(4.0, 1.0, 0.0)
    estimate.move(0.5, 0.0)
    estimate.fix(4.0, 0.0, 50)
    assert (estimate.x_m, estimate.y_m, estimate.fixes) == (2.0, 0.0, 1)
    estimate.fix(2.0, 0.0, 50)  # where it stands: no direction is believed
    assert (estimate.error_m(2.0, 3.0), estimate.fixes) == (3.0, 1)
