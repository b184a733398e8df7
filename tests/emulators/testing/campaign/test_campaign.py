"""Campaigns from the command line to the table: whatever happens meanwhile, it is the same."""

from __future__ import annotations

import csv
import re
import shlex
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.emulators.testing.campaign.conftest import ANSWERS, HEAD, TICKRIG, Campaign
from tickrig.emulators.testing.campaign.order import Run, RunVerdict, verdicts_of

WHOLE = ("test_rrc.py", "--seeds", "0-29", "--param", "flip=0.0001,0.001")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def add_test(folder: Path, body: str) -> None:
    """Have a test whose first statements are these, and which then passes."""
    head = "\n\ndef test_more(bench, request):\n    seed = seed_of(request)\n"
    text = HEAD + head + "".join(f"    {line}\n" for line in body.splitlines())
    (folder / "test_rrc.py").write_text(f"{text}    bench.run_for('100ms')\n", "utf-8")


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ([RunVerdict(1, "passed")], ""),
        ([(1, "failed", 5, "a.py:3", "why")], ""),
        ([], "0 items in place of 1 verdict"),
        ([RunVerdict(1, "passed")] * 2, "2 items in place of 1 verdict"),
        (5, "int in place of 1 verdict"),
        (None, "NoneType in place of 1 verdict"),
        ([7], "7 in place of a verdict of run 1"),
        ([(1, 2)], "(1, 2) in place of a verdict of run 1"),
        ([RunVerdict(2, "passed")], "Verdict(number=2, outcome='passed'"),
        ([RunVerdict(1, "splendid")], "Verdict(number=1, outcome='splendid'"),
        ([RunVerdict(1, "passed", -1)], "Verdict(number=1, outcome='passed', virtual_us=-1"),
        ([(1, "failed", 5, None, "why")], "(1, 'failed', 5, None, 'why') in place of"),
    ],
)
def test_only_verdicts_of_the_runs_are_taken(answer: object, said: str) -> None:
    runs = [Run(1, "test_rrc.py::test_it_answers", 0)]
    if said:
        with pytest.raises(ValueError, match=re.escape(said)):
            verdicts_of(answer, runs)
    else:
        assert verdicts_of(answer, runs) == answer


def test_a_worker_that_sends_something_else_is_replaced(folder: Path, tickrig: Campaign) -> None:
    send = "os.write(int(sys.argv[1]), {})"
    whole = send.format("b'\\0\\0\\0\\4junk'")
    endless = send.format("b'junk'")
    add_test(
        folder,
        "import sys\n"
        f"if seed == 2 and once('a'): {whole}\n"
        f"if seed == 3 and once('b'): {endless}\n"
        f"if seed == 4: {whole}",
    )
    tickrig("test_rrc.py", "--seeds", "0-5", "-j", "1", status=1)
    outcomes = [row["outcome"] for row in rows(folder / "campaign.csv")]
    assert outcomes == ["passed"] * 4 + ["died", "passed"]
    assert "when it sent unreadable data" in rows(folder / "campaign.csv")[4]["reason"]


def test_the_table_is_the_same_in_shards_and_by_any_number_of_processes(
    folder: Path, tickrig: Campaign
) -> None:
    done = tickrig(*WHOLE, "-j", "1", status=1)
    table = (folder / "campaign.csv").read_bytes()
    tickrig(*WHOLE, "-j", "3", "--fresh", status=1)
    assert (folder / "campaign.csv").read_bytes() == table
    tickrig(*WHOLE, "--shard", "1/2", status=1)
    tickrig(*WHOLE, "--shard", "2/2", "-o", "b.csv", status=1)
    merged = tickrig("merge", "b.csv", "campaign-1-of-2.csv", "-o", "all.csv", status=1)
    assert (folder / "all.csv").read_bytes() == table
    assert merged.stdout == done.stdout.replace("campaign.csv", "all.csv")
    assert merged.stderr == ""
    found = Counter((row["flip"], row["outcome"]) for row in rows(folder / "campaign.csv"))
    assert found[("0.001", "failed")] > found[("0.0001", "failed")]
    assert found[("0.001", "passed")] > 0
    assert not list(folder.glob("*.journal"))


def test_a_run_that_failed_is_replayed_with_its_trace(folder: Path, tickrig: Campaign) -> None:
    done = tickrig(*WHOLE, status=1)
    failed = [row for row in rows(folder / "campaign.csv") if row["outcome"] == "failed"]
    assert failed[0]["reason"] == "AssertionError: a bit was flipped"
    line = next(
        number
        for number, text in enumerate((folder / "test_rrc.py").read_text().splitlines(), 1)
        if "a bit was flipped" in text
    )
    assert failed[0]["where"] == f"test_rrc.py:{line}"
    command = failed[0]["replay"]
    assert f"  {command}\n" in done.stdout
    plugin = ["-p", "tickrig.emulators.testing.plugin.pytest_plugin"]
    words = [sys.executable, "-m", *shlex.split(command), *plugin]
    again = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert again.returncode == 1
    assert "AssertionError: a bit was flipped" in again.stdout
    (trace,) = (folder / "kept").glob("*.trace")
    replay = [sys.executable, "-c", TICKRIG, "replay", str(trace)]
    subprocess.run(replay, cwd=folder, check=True, capture_output=True)


def test_each_run_has_its_fixtures_as_if_it_were_alone(folder: Path, tickrig: Campaign) -> None:
    (folder / "conftest.py").write_text(
        """
import pytest

@pytest.fixture(scope="session")
def of_session(): return []

@pytest.fixture(scope="module")
def of_module(): return []

@pytest.fixture
def own(tmp_path): return tmp_path
""",
        "utf-8",
    )
    (folder / "test_rrc.py").write_text(
        HEAD
        + """

class TestThem:
    def test_fixtures(self, bench, of_session, of_module, own, monkeypatch, request):
        of_session.append(seed_of(request))
        of_module.append(1)
        assert of_session == list(range(len(of_session)))
        assert of_module == [1]
        assert not list(own.iterdir())
        monkeypatch.setenv("MINE", "1")

    @pytest.mark.parametrize("way", ["up", "down"])
    @pytest.mark.req("SAF-1")
    async def test_async(self, bench, way, request):
        await bench.sleep("10ms")
        assert request.node.user_properties == [("req", "SAF-1")]

    @pytest.mark.xfail(reason="known")
    def test_expected(self, bench):
        raise AssertionError

    @pytest.mark.needs("real")
    def test_elsewhere(self, bench):
        pass


def test_without(request):
    pass
""",
        "utf-8",
    )
    done = tickrig("test_rrc.py", "--seeds", "0-5", "-j", "1", "-o", "a.csv")
    assert done.stderr == "1 test without a bench left out\n"
    assert done.stdout == "a.csv: 30 runs, 18 passed, 12 skipped\n"
    assert {(r["test"], r["reason"]) for r in rows(folder / "a.csv") if r["reason"]} == {
        ("test_rrc.py::TestThem::test_expected", "expected to fail: known"),
        (
            "test_rrc.py::TestThem::test_elsewhere",
            "needs real, and this bench is virtual",
        ),
    }


def test_the_runs_of_a_worker_that_was_killed_are_done_again(
    folder: Path, tickrig: Campaign
) -> None:
    kill = "os.kill(os.getpid(), signal.SIGKILL)"
    add_test(folder, f"if seed in (3, 17) and once(f'killed-{{seed}}'): {kill}")
    tickrig("test_rrc.py", "--seeds", "0-29", "-o", "a.csv")
    assert (folder / "killed-3").exists()
    assert (folder / "killed-17").exists()
    tickrig("test_rrc.py", "--seeds", "0-29", "-o", "b.csv")
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()
    assert len(rows(folder / "a.csv")) == 30


def test_a_run_that_always_ends_its_process_is_told(folder: Path, tickrig: Campaign) -> None:
    add_test(
        folder, "if seed == 2: os.abort()\nif seed == 3: pytest.exit('enough')\nbench.get('state')"
    )
    done = tickrig("test_rrc.py", "--seeds", "0-5", "-j", "1", status=1)
    assert done.stdout.startswith("campaign.csv: 6 runs, 4 passed, 1 error, 1 died\n")
    reasons = {row["seed"]: row["reason"] for row in rows(folder / "campaign.csv")}
    assert reasons["2"] == "its process ended 3 times, the last by signal 6, Aborted"
    assert reasons["3"] == "exit: enough"


@pytest.mark.realtime
def test_a_run_that_hangs_is_ended(folder: Path, tickrig: Campaign) -> None:
    add_test(folder, "while seed == 2: pass")
    done = tickrig("test_rrc.py", "--seeds", "0-5", "--timeout", "3s", status=1)
    assert done.stdout.startswith("campaign.csv: 6 runs, 5 passed, 1 hung\n")
    assert "  no verdict within 3 s\n  seeds 2 (1)\n  pytest test_rrc.py::test_more" in done.stdout


@pytest.mark.parametrize(
    ("sent", "status", "said"),
    [
        ("SIGKILL", -9, ""),
        ("SIGINT", 130, "interrupted: {} of 30 runs are kept; go on with tickrig campaign "),
    ],
)
def test_the_same_command_goes_on(
    folder: Path, tickrig: Campaign, sent: str, status: int, said: str
) -> None:
    add_test(folder, f"if seed == 20 and once('sent'): os.kill(os.getppid(), signal.{sent})")
    words = ("test_rrc.py", "--seeds", "0-29", "-j", "2")
    done = tickrig(*words, status=status)
    assert not (folder / "campaign.csv").exists()
    path = folder / "campaign.csv.journal"
    kept = path.read_bytes().count(b"\n") - 1
    assert 0 < kept < 30
    assert done.stderr.startswith(said.format(kept))
    path.write_bytes(path.read_bytes()[:-7])  # power was lost while it was written
    again = tickrig(*words)
    assert again.stderr == f"campaign.csv.journal: {kept - 1} of 30 runs are done\n"
    tickrig(*words, "-o", "b.csv")
    assert (folder / "campaign.csv").read_bytes() == (folder / "b.csv").read_bytes()


def test_where_the_disk_is_full_it_ends_and_goes_on_later(folder: Path, tickrig: Campaign) -> None:
    words = ["test_rrc.py", "--seeds", "0-99"]
    command = shlex.join([sys.executable, "-c", TICKRIG, "campaign", *words])
    whole = "PYTHONDONTWRITEBYTECODE=1"  # else modules that are not compiled yet are cut, too
    full = subprocess.run(
        ["sh", "-c", f"ulimit -f 2; exec env {whole} {command}"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert full.returncode == 3, full.stdout + full.stderr
    assert full.stderr.startswith("campaign.csv.journal: File too large; make room: ")
    assert "of 100 runs are kept; go on with tickrig campaign test_rrc.py" in full.stderr
    assert "Traceback" not in full.stderr
    tickrig(*words, status=1)
    tickrig(*words, "-o", "b.csv", status=1)
    assert (folder / "campaign.csv").read_bytes() == (folder / "b.csv").read_bytes()


NODE_TEST = """
import pytest
from tickrig.wire.can import CanFrame

@pytest.fixture
def bench_config():
    return "2=epos"

@pytest.fixture
def spec():
    return "drop=rate=0.001"

def test_one(bench, spec):
    bench.run_for("10ms")
    bench["epos"].fault(spec)
    bench.link.send((CanFrame.parse("602#4081600000000000"),))
    bench.run_for("10ms")
    assert " < 582#4381600" in bench.transcript()
"""


def test_a_fault_with_commas_is_one_value(folder: Path, tickrig: Campaign) -> None:
    (folder / "test_node.py").write_text(NODE_TEST)
    values = 'spec="sdo_slow=1s,count=2",sdo_twice'
    words = ["test_node.py", "--seeds", "0-1", "--param", values, "-o", "node.csv"]
    assert "--bench-param 'spec=\"sdo_slow=1s,count=2\"'" in tickrig(*words, status=1).stdout
    table = (folder / "node.csv").read_text().splitlines()
    outcomes = [("passed" in line, "sdo_twice" in line) for line in table[1:]]
    assert sorted(outcomes) == [(False, False)] * 2 + [(True, True)] * 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--seeds", "9-0"], "--seeds: 9-0 runs backwards: write 0-9"),
        (["--shard", "9/8"], "--shard: '9/8' is no part of a campaign"),
        (["-o", "a.txt"], "-o a.txt: a table is a .csv or a .parquet"),
        (["-o", "no/a.csv"], "-o: table no/a.csv: no directory no"),
        (["-o", "there.csv"], "there.csv is there already: --fresh replaces it"),
        (["--param", "flip"], "--bench-param flip: write NAME=VALUE,VALUE, as flip=0.001"),
        (["--param", "flp=1"], "--bench-param flp: no test takes it; did you mean 'flip'?"),
        (["-k", "nothing"], "no tests were collected"),
        (["--bench", "no.toml"], "no.toml: No such file or directory"),
        (["--timeout", "0"], "--timeout 0: no run is over at once; write 60s"),
        (["--timeout", "5"], "--timeout '5' has no unit: write 5s, 5ms or 5us"),
        (["test_no.py"], "file or directory not found: test_no.py"),
        (["test_wrong.py"], "test_wrong.py: SyntaxError: "),
        (["test_broken.py"], "test_broken.py: "),
        (
            ["test_bare.py"],
            "no test takes the fixture bench, so no seed changes anything: ",
        ),
        (["test_own.py", "--param", "flip=1"], "flip has values of its own; make it a fixture"),
        (["--scheduler", "nowhere"], "--scheduler nowhere: write tcp://HOST:PORT"),
    ],
)
def test_what_cannot_be_is_told_in_a_line(
    folder: Path, tickrig: Campaign, words: list[str], said: str
) -> None:
    (folder / "there.csv").touch()
    (folder / "test_wrong.py").write_text("def (:\n")
    (folder / "test_broken.py").write_text("import nobody_has_this\n")
    (folder / "test_bare.py").write_text("def test_it(): pass\n")
    mark = "@pytest.mark.parametrize('flip', [1])\n"
    (folder / "test_own.py").write_text(f"{HEAD}\n{mark}def test_it(bench, flip): pass\n")
    tests = [] if words[0].startswith("test_") else ["test_rrc.py"]
    seeds = [] if "--seeds" in words else ["--seeds", "0-2"]
    done = tickrig(*tests, *words, *seeds, status=2)
    line = done.stderr.removeprefix("Error: ")
    assert said in line
    assert line.count("\n") == 1, line
    assert done.stdout == ""


@pytest.mark.parametrize("changed", ["test_rrc.py", "my_host.py", "conftest.py"])
def test_what_was_changed_meanwhile_is_not_of_this_campaign(
    folder: Path, tickrig: Campaign, changed: str
) -> None:
    (folder / "my_host.py").write_text("")
    (folder / "conftest.py").write_text("import my_host\n")
    add_test(folder, "if seed == 20 and once('sent'): os.kill(os.getppid(), signal.SIGKILL)")
    tickrig("test_rrc.py", "--seeds", "0-29", status=-9)
    (folder / changed).write_text((folder / changed).read_text() + "# changed\n")
    done = tickrig("test_rrc.py", "--seeds", "0-29", status=2)
    assert "campaign.csv.journal is of a campaign with files of the tests " in done.stderr
    tickrig("test_rrc.py", "--seeds", "0-29", "--fresh")


def test_a_journal_that_is_done_becomes_the_table(folder: Path, tickrig: Campaign) -> None:
    """As where it was killed between the table and the end."""
    add_test(folder, "")
    tickrig("test_rrc.py", "--seeds", "0-3", "-j", "1")
    table = (folder / "campaign.csv").read_bytes()
    add_test(folder, "if seed == 3 and once('sent'): os.kill(os.getppid(), signal.SIGKILL)")
    tickrig("test_rrc.py", "--seeds", "0-3", "-j", "1", "--fresh", status=-9)
    assert (folder / "campaign.csv").read_bytes() == table  # it stays until the new one is there
    tickrig("test_rrc.py", "--seeds", "0-3", "-j", "1")
    assert b"test_more" in (folder / "campaign.csv").read_bytes()


SNAPSHOT = """

@pytest.fixture
def bench_warm_up():
    def switch_on(bench):
        with Path("warmed").open("a") as file:
            file.write("once\\n")
        {more}
        bench.run_for("1s")
    return switch_on
"""


@pytest.mark.parametrize(
    ("more", "times"), [("bench.clear('flip')", 1), ("bench.fault('drop=0.001', for_='1ms')", 12)]
)
def test_runs_begin_with_a_snapshot_where_nothing_is_left_to_chance(
    folder: Path, tickrig: Campaign, more: str, times: int
) -> None:
    (folder / "test_rrc.py").write_text(HEAD + SNAPSHOT.format(more=more) + ANSWERS, "utf-8")
    tickrig("test_rrc.py", "--seeds", "0-11", "-j", "1", status=1)
    assert (folder / "warmed").read_text().count("once") == times
    for row in rows(folder / "campaign.csv")[3:6]:  # each by a worker that has no snapshot
        status = int(row["outcome"] == "failed")
        words = ("--seeds", row["seed"], "-o", "one.csv", "--fresh")
        tickrig("test_rrc.py", *words, status=status)
        assert rows(folder / "one.csv") == [row]
