"""Campaigns: what a minute of an RRC costs as a run, and what a second process gains."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

import tickrig
from benchmarks.table import row
from tickrig import Bench
from tickrig.device import Rrc
from tickrig.emulators.testing.campaign.crew import Crew, LocalWorkers
from tickrig.emulators.testing.campaign.journal import CampaignJournal
from tickrig.emulators.testing.campaign.order import CampaignOrder
from tickrig.emulators.testing.campaign.plan import CampaignPlan, Seeds
from tickrig.emulators.testing.commands.campaign_run import Campaign

TEST = """
import pytest

from tickrig.device import Rrc
from tickrig.host import RrcClient, RrcEvent


@pytest.fixture
def bench_config():
    return Rrc()


def test_a_minute(bench):
    drive(bench)


def drive(bench):
    with RrcClient(bench.link) as client:
        client.start()
        bench.press("power_button")
        client.wait_for(RrcEvent.POWER_ON_SUCCESS, 5_000_000)
        client.stablemode()
        bench.fault("flip=0.0001", for_="50s")
        while bench.now_us < 59_000_000:
            client.output(v_pct=30, w_pct=0, confirm=False)
            client.run_for(50_000)
            assert bench.get("out_v_pct") in (0, 30)
        client.run_for(60_000_000 - bench.now_us)


def test_nothing(bench):
    pass
"""
"""A minute of virtual time: 100 status lines a second, 20 commands, bits that turn over."""

COMMAND = "from tickrig.commands import tickrig; tickrig()"
TURNS = 20_000_000
LOOP = f"for _ in range({TURNS}): pass"
RUNS = 20
ROUNDS = 5


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    os.environ["PYTHONPATH"] = str(Path(tickrig.__file__).parents[1])
    with TemporaryDirectory() as folder:
        Path(folder, "test_rrc.py").write_text(TEST, "utf-8")
        row("a minute of an RRC, without pytest", [alone(20)], "ms of processor")
        processors(folder)
        gains(folder)


def gains(folder: str) -> None:
    """Print what a second process gains, of a loop without work and of a campaign, in turn."""
    loops, campaigns = [], []
    crew = Crew(CampaignOrder(tests=("test_rrc.py",), keyword="minute", folder=folder))
    with closing(crew):
        both = LocalWorkers(crew, crew.collect().digest, 2)
        campaign_s(folder, crew, both, 8)  # two workers are there from now on
        one = LocalWorkers(crew, crew.collect().digest, 1)
        for _ in range(ROUNDS):
            loops.append(gain_of_loops())
            taken_s = campaign_s(folder, crew, one, RUNS), campaign_s(folder, crew, both, 2 * RUNS)
            campaigns.append(2 * taken_s[0] / taken_s[1])
    row("a loop without work: gain of a second process", loops, "times")
    row("a campaign: gain of a second process", campaigns, "times")


def campaign_s(folder: str, crew: Crew, workers: LocalWorkers, runs: int) -> float:
    """Return how long runs take by the clock, whose workers are there."""
    plan = CampaignPlan(crew.order, crew.collect(), Seeds.parse(f"0-{runs - 1}"))
    journal = CampaignJournal(Path(folder, "a.journal"), plan.head)
    began_s = time.perf_counter()
    for _ in Campaign(plan, journal, workers).verdicts():
        pass
    taken_s = time.perf_counter() - began_s
    journal.remove()
    return taken_s


def alone(times: int) -> float:
    """Return the milliseconds of processor time of a run that nobody manages."""
    names: dict[str, object] = {}
    exec(TEST, names)
    drive = names["drive"]
    assert callable(drive)
    began = time.process_time()
    for seed in range(times):
        with Bench(Rrc(), seed=seed) as bench:
            drive(bench)
    return (time.process_time() - began) / times * 1e3


def processors(folder: str) -> None:
    """Print what runs take in a campaign, its start left out."""
    for what, keyword, few, many in (
        ("a minute of an RRC, a run of a campaign", "minute", 10, 40),
        ("a test that does nothing, a run of a campaign", "nothing", 100, 1_100),
    ):
        before, after = (campaign(folder, keyword, runs, 1)[1] for runs in (few, many))
        row(what, [(after - before) / (many - few) * 1e3], "ms of processor")


def campaign(folder: str, keyword: str, runs: int, workers: int) -> tuple[float, float]:
    """Return wall and processor time of a campaign in seconds."""
    words = ("test_rrc.py", "--seeds", f"0-{runs - 1}", "-j", str(workers), "--fresh")
    return together([[sys.executable, "-c", COMMAND, "campaign", *words, "-k", keyword]], folder)


def gain_of_loops() -> float:
    """Return by how much two processes do more of a loop than one."""
    loop = [sys.executable, "-S", "-c", LOOP]
    return 2 * together([loop], ".")[0] / together([loop, loop], ".")[0]


def together(commands: Sequence[Sequence[str]], folder: str) -> tuple[float, float]:
    """Run commands beside each other; return wall and processor time in seconds."""
    began_s, before = time.perf_counter(), os.times()
    running = [subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL) for words in commands]
    for process in running:
        if process.wait():
            raise SystemExit(f"{process.args!r} ended with {process.returncode}")
    after = os.times()
    spent_s = sum(after[2:4]) - sum(before[2:4])
    return time.perf_counter() - began_s, spent_s
