"""`canmon net lss` on rigs in virtual time: what it does, asks and leaves behind."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.net.test_net_verbs import net
from tests.host.canopen.commissioning.net_bench import NetBench
from tests.host.canopen.commissioning.test_lss_master import Late
from tickrig.device import make_epos
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.net import session
from tickrig.host.canopen.commissioning.lss_master import LssMaster

RIG = """\
[device.drive]
type = "epos"
node_id = "lss"

[device.module]
type = "f-palette"
node_id = "lss"

[device.other]
type = "f-palette"
node_id = 16
"""
MODULE, DRIVE = "00000000:00000001:00010000:00000001", "00000000:00006210:00010000:00000001"


def test_nodes_without_a_node_id_are_listed(rig: str) -> None:
    result = net(rig, "lss")
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.splitlines() == [f"{MODULE}  no node-ID", f"{DRIVE}  no node-ID"]
    assert "nodes without a node-ID are there: canmon net SOURCE lss" in net(rig, "scan").stderr


def test_nodes_found_get_node_ids_in_turn(rig: str) -> None:
    result = net(rig, "lss", "--fastscan", "--node-id", "5-9", "--store")
    assert (result.exit_code, result.stderr.splitlines()) == (
        0,
        ["done: node-ID 5, store", "done: node-ID 6, store"],
    )


def test_a_dry_run_configures_nothing(rig: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("configure_node_id", "configure_bit_rate", "store", "activate_bit_rate"):
        monkeypatch.delattr(LssMaster, name)
    words = ("--identity", "0:6210:10000:1", "--node-id", "7", "--bit-rate", "500k", "--store")
    result = net(rig, "lss", *words, "--dry-run")
    assert (result.exit_code, result.stdout) == (0, f"{DRIVE}  no node-ID\n")
    assert result.stderr == "dry run, not done: node-ID 7, bit rate 500k, store\n"


def test_a_node_with_a_node_id_keeps_it_until_its_reset(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text('[device.drive]\ntype = "epos"\nnode_id = 5\n')
    result = net(str(path), "lss", "--only-node", "--node-id", "7")
    assert result.exit_code == 0, result.output
    assert result.stdout == f"{DRIVE}  node-ID 5\n"
    assert "node-ID 7 counts from its next reset: nmt reset-node 5" in result.stderr


def test_an_end_in_the_middle_leaves_all_waiting(rig: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def press(master: LssMaster) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(LssMaster, "store", press)
    words = ("--fastscan", "--node-id", "5", "--bit-rate", "500k", "--store")
    result = net(rig, "lss", *words)
    assert result.exit_code == 130
    assert result.stderr == (
        "interrupted; done: node-ID 5, bit rate 500k; not done: store;"
        " all nodes were sent back to LSS waiting\n"
    )


def test_a_node_that_dies_in_the_middle_is_told(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(
        '[device.drive]\ntype = "epos"\nnode_id = "lss"\n[fault]\ndrive = "power_off@1s"\n'
    )
    result = net(str(path), "lss", "--fastscan", "--node-id", "5")
    assert result.exit_code == 1
    assert "is not confirmed; a slave is gone, or needs longer than 20 ms" in result.stderr
    assert result.stderr.endswith("; all nodes were sent back to LSS waiting\n")


@pytest.fixture
def twins(monkeypatch: pytest.MonkeyPatch) -> NetBench:
    """Two nodes with the same identity, and without a node-ID."""
    bench = NetBench(make_epos(255), Late(make_epos(255), 2_000))
    source = ConformSource(bench.host, "a-bus", "a bus in virtual time", virtual=True)
    monkeypatch.setattr(session, "open_conform_source", lambda *words: source)
    return bench


def test_nodes_with_one_identity_get_no_node_id(twins: NetBench) -> None:
    result = net("a-bus", "lss", "--fastscan", "--node-id", "5", "--store")
    assert result.exit_code == 1
    assert result.stderr == (
        f"Error: 2 nodes have the identity {DRIVE}: LSS cannot tell them apart, so they were"
        " not configured; connect one after the other; all nodes were sent back to LSS waiting\n"
    )
    twins.rig.run_for(1_000_000)
    assert "705#00" not in twins.frames


def test_nodes_with_one_identity_are_listed_as_such(twins: NetBench) -> None:
    result = net("a-bus", "lss")
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout == f"{DRIVE}  no node-ID, 2 nodes with this identity\n"


@pytest.mark.parametrize(
    ("words", "status", "why"),
    [
        (("--fastscan", "--node-id", "15-17"), 2, "node-ID 16 is taken: a node answers there"),
        (("--node-id", "5"), 2, "which node? --identity V:P:R:S, --fastscan, or --only-node"),
        (("--fastscan", "--only-node"), 2, "--only-node: which node? give one"),
        (("--fastscan", "--node-id", "0"), 2, "'0' is no node-ID 1..127, and no range"),
        (("--fastscan", "--node-id", "9-5"), 2, "'9-5' is no node-ID 1..127, and no range"),
        (("--only-node", "--node-id", "5-9"), 2, "several nodes, which only --fastscan finds"),
        (("--fastscan", "--bit-rate", "300k"), 2, "not a bit rate of CiA 305: 10k, 20k, 50k, 125k"),
        (("--fastscan", "--bit-rate", "k"), 2, "'k' is not a bit rate of CiA 305"),
        (("--fastscan", "--activate", "1s"), 2, "give --bit-rate as well"),
        (
            ("--only-node", "--bit-rate", "1M", "--activate", "70s"),
            2,
            "70000 ms is not in 1..65535 ms",
        ),
        (("--identity", "1:2:3"), 2, "'1:2:3' is not V:P:R:S in hex"),
        (("--identity", "1:2:3:4"), 1, "no node with the identity 00000001:00000002"),
        (("--only-node",), 1, "2 slaves answered, where one may"),
    ],
)
def test_what_cannot_be_is_one_line(
    rig: str, words: tuple[str, ...], status: int, why: str
) -> None:
    result = net(rig, "lss", *words)
    assert result.exit_code == status, result.output
    (told,) = (line for line in result.stderr.splitlines() if line.startswith("Error:"))
    assert why in told
