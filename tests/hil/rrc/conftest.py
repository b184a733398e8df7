"""The benches that the test bodies run on."""

from __future__ import annotations

from collections.abc import Generator, Iterator

import pytest

from tests.hil.rrc.bench import Bench, pty_bench, real_bench, sim_bench
from tests.hil.rrc.rig_file import RIG
from tests.hil.rrc.verdict import BENCH, judge


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    real = RIG in metafunc.config.stash
    if "ready" in metafunc.fixturenames:
        # In real time the shorter way must do, step 4 is the slow repetition of step 5.
        both = [("sim", "plain"), ("sim", "stable"), ("pty", "stable")]
        pairs = [("real", "plain"), ("real", "stable")] if real else both
        metafunc.parametrize(("bench", "ready"), [_timed(*pair) for pair in pairs], indirect=True)
    elif "bench" in metafunc.fixturenames:
        kinds = ["real"] if real else ["sim", "pty"]
        metafunc.parametrize("bench", [_timed(kind) for kind in kinds], indirect=True)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Call nothing a failure of the device that the machine is to blame for."""
    report = yield
    judge(report, item.stash.get(BENCH, None))
    return report


def _timed(kind: str, *others: str) -> object:
    marks = () if kind == "sim" else (pytest.mark.realtime,)
    return pytest.param(kind, *others, marks=marks)


@pytest.fixture
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    """An RRC that waits for its power button."""
    match request.param:
        case "sim":
            chosen = sim_bench()
        case "pty":
            chosen = pty_bench()
        case "real":
            chosen = real_bench(request.config.stash[RIG], request.config)
        case kind:
            raise ValueError(f"no bench {kind!r}")
    with chosen as bench:
        request.node.stash[BENCH] = bench
        try:
            bench.begin()
            yield bench
        finally:
            bench.close()


@pytest.fixture
def standby(bench: Bench) -> Bench:
    """An RRC in Standby."""
    bench.switch_on()
    return bench


@pytest.fixture
def ready(request: pytest.FixtureRequest, standby: Bench) -> Bench:
    """An RRC in Standby, without stablemode (step 4 of the manual's test) and with it (step 5)."""
    if request.param == "stable":
        standby.client.stablemode()
        standby.stable = True
    return standby
