"""A campaign over a Dask cluster of real processes on loopback."""

from __future__ import annotations

import logging
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.emulators.testing.campaign.conftest import TICKRIG, Campaign
from tests.emulators.testing.campaign.test_campaign import add_test
from tickrig.emulators.testing.campaign.order import CampaignOrder, CampaignRefusal, Collected
from tickrig.emulators.testing.campaign.plan import CampaignPlan, Seeds, Shard

if "CI" not in os.environ:  # there it fails without them
    pytest.importorskip("distributed", reason="no Dask here: pip install 'tickrig[campaign]'")

pytestmark = pytest.mark.realtime

DASK = (sys.executable, "-m", "dask")


def started(pattern: str, *words: str) -> tuple[subprocess.Popen[str], str]:
    """Start a process of Dask; return it, and what its output has for the pattern."""
    process = subprocess.Popen(
        [*DASK, *words], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stderr is not None
    for line in process.stderr:
        if found := re.search(pattern, line):
            return process, found[0]
    raise AssertionError(f"{words} has ended")


def end(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


LIAR = """
from tickrig.emulators.testing.campaign import dask_workers


def dask_setup(worker):
    do = dask_workers._do
    dask_workers._do = lambda *words: do(*words)[1:]
"""


@pytest.fixture
def liar(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let workers leave out the first verdict of each answer."""
    (folder / "liar.py").write_text(LIAR, "utf-8")
    monkeypatch.setenv("DASK_DISTRIBUTED__WORKER__PRELOAD", str(folder / "liar.py"))


@pytest.fixture
def cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """Give the address of a scheduler with two workers, and their processes."""
    host = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    scheduler, url = started(r"tcp://127\.0\.0\.1:\d+", "scheduler", *host, "--no-show")
    processes = [scheduler]
    local = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
    try:
        for _ in range(2):
            words = ("worker", url, *local, "--local-directory", str(folder / "dask"))
            processes.append(started("Registered to", *words)[0])
        yield url, processes
    finally:
        for process in processes[::-1]:
            end(process)


Cluster = tuple[str, list[subprocess.Popen[str]]]


def test_the_table_is_that_of_one_machine(
    folder: Path, tickrig: Campaign, cluster: Cluster
) -> None:
    words = ("test_rrc.py", "--seeds", "0-29", "--param", "flip=0.0001,0.001")
    outputs = ("-o", "b.csv", "-o", "b.parquet")
    tickrig(*words, *outputs, "--scheduler", cluster[0], status=1)
    tickrig(*words, "-o", "a.csv", "-o", "a.parquet", status=1)
    assert (folder / "b.csv").read_bytes() == (folder / "a.csv").read_bytes()
    assert (folder / "b.parquet").read_bytes() == (folder / "a.parquet").read_bytes()
    tickrig("merge", "b.parquet", "-o", "c.csv", status=1)
    assert (folder / "c.csv").read_bytes() == (folder / "a.csv").read_bytes()


def test_runs_of_a_worker_that_is_lost_are_done_by_the_other(
    folder: Path, tickrig: Campaign, cluster: Cluster
) -> None:
    kill = "os.kill(os.getppid(), signal.SIGKILL)"
    add_test(folder, f"if seed == 20 and once('killed'): {kill}")
    words = ("test_rrc.py", "--seeds", "0-29")
    tickrig(*words, "--scheduler", cluster[0])
    tickrig(*words, "-o", "a.csv")
    assert (folder / "campaign.csv").read_bytes() == (folder / "a.csv").read_bytes()
    assert [process.poll() for process in cluster[1]].count(None) == 2  # the scheduler, and one


def test_a_cluster_that_is_gone_is_told_and_the_campaign_goes_on_here(
    folder: Path, tickrig: Campaign, cluster: Cluster
) -> None:
    scheduler = cluster[1][0].pid
    kill = f"os.kill({scheduler}, signal.SIGKILL)"
    add_test(folder, f"if seed == 20 and once('killed'): {kill}")
    words = ("test_rrc.py", "--seeds", "0-29")
    done = tickrig(*words, "--scheduler", cluster[0], status=2)
    assert done.stderr == f"Error: --scheduler {cluster[0]} is gone; what was done is kept\n"
    again = tickrig(*words)
    assert re.fullmatch(r"campaign\.csv\.journal: \d+ of 30 runs are done\n", again.stderr)


def test_a_worker_that_leaves_out_a_verdict_is_told(
    folder: Path, tickrig: Campaign, liar: None, cluster: Cluster
) -> None:
    done = tickrig("test_rrc.py", "--seeds", "0-29", "--scheduler", cluster[0], status=2)
    said = "a worker sent 0 items in place of 1 verdict"
    assert done.stderr == f"Error: --scheduler {cluster[0]}: {said}\n"


def test_ctrl_c_ends_a_campaign_whose_scheduler_stands(folder: Path, cluster: Cluster) -> None:
    stop = f"os.kill({cluster[1][0].pid}, signal.SIGSTOP)"
    interrupt = "os.kill(int(Path('pid').read_text()), signal.SIGINT)"
    add_test(folder, f"if seed == 20:\n    {stop}\n    {interrupt}")
    words = ("campaign", "test_rrc.py", "--seeds", "0-99", "--scheduler", cluster[0])
    command = shlex.join([sys.executable, "-c", TICKRIG, *words])
    script = ["sh", "-c", f"echo $$ > pid; exec {command}"]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert done.returncode == 130
    assert re.match(r"interrupted: \d+ of 100 runs are kept; go on with tickrig ", done.stderr)


@pytest.mark.parametrize(
    ("greeting", "said"),
    [
        (b"HTTP/1.0 400 Bad Request\r\n\r\n", "no Dask scheduler: "),
        (b"", "no answer within 0.5 s"),
    ],
)
def test_what_is_no_scheduler_is_told(
    greeting: bytes, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tickrig.emulators.testing.campaign import dask_workers  # noqa: PLC0415 - an extra

    monkeypatch.setattr(dask_workers, "_CONNECT_S", 0.5)
    plan = CampaignPlan(
        CampaignOrder(tests=()), Collected((), (), ""), Seeds.parse("0"), Shard.parse("1/1")
    )
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        threading.Thread(target=greet, args=(listener, greeting), daemon=True).start()
        with pytest.raises(CampaignRefusal, match=f"--scheduler tcp://127.0.0.1:{port}: {said}"):
            dask_workers.DaskWorkers(f"tcp://127.0.0.1:{port}", plan)


def greet(listener: socket.socket, greeting: bytes) -> None:
    """Send something to whoever comes, and wait until it has gone."""
    connection, _ = listener.accept()
    with connection:
        connection.sendall(greeting)
        while connection.recv(4_096):
            pass


def test_a_traceback_of_tornado_is_not_shown(capfd: pytest.CaptureFixture[str]) -> None:
    from tickrig.emulators.testing.campaign.dask_workers import be_quiet  # noqa: PLC0415 - an extra

    be_quiet()
    for name in ("tornado.application", "asyncio", "distributed.client"):
        logging.getLogger(name).error("Exception in callback")
    assert capfd.readouterr().err == ""


def test_tests_of_a_worker_that_are_not_the_same_are_refused(
    folder: Path, tickrig: Campaign, cluster: Cluster
) -> None:
    add_test(folder, "if seed == 3 and once('x'): Path('test_rrc.py').open('a').write('#\\n')")
    add = "if seed == 4 and once('y'): os.kill(os.getpid(), signal.SIGKILL)"
    path = folder / "test_rrc.py"
    path.write_text(path.read_text().replace("    bench.run_for", f"    {add}\n    bench.run_for"))
    done = tickrig("test_rrc.py", "--seeds", "0-29", "--scheduler", cluster[0], status=2)
    said = "the files of the tests are not the same everywhere: they were changed"
    assert re.fullmatch(rf"Error: tcp://127\.0\.0\.1:\d+: {said}\n", done.stderr)
