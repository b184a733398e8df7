"""`--eds-dir`: EDS files of a folder, chosen by what a node says of itself."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.wire import Wire
from tests.wire.canopen.eds.xdd_text import XDD
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.decode.eds_folder import EdsFiles, EdsFolder, EdsIdentity
from tickrig.host.canmon.sources import source as block_log

EPOS = Path(__file__).parents[4] / "examples" / "eds" / "epos.eds"
TEXT = EPOS.read_text()
REVISION = "RevisionNumber=0x00010000"
PRODUCT = 0x6210
WHO = [  # 1018h:01 to 03 are read, then a PDO
    *("605#4018100100000000", "585#4318100100000000"),
    *("605#4018100200000000", "585#4318100210620000"),
    *("605#4018100300000000", "585#4318100300000100"),
    "185#3702D2040000",
]


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words, catch_exceptions=False)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the file of our drive, and with others."""
    found = tmp_path / "eds"
    found.mkdir()
    (found / "drive.eds").write_text(TEXT)
    (found / "other.eds").write_text(TEXT.replace("0x00006210", "0x00006211"))
    (found / "broken.eds").write_bytes(b"\0\1\2[DeviceInfo")
    (found / "readme.txt").write_text("EDS files of all drives")
    return found


@pytest.fixture
def log(tmp_path: Path) -> str:
    path = tmp_path / "run.log"
    frames = (f"({second}.000000) can0 {frame}\n" for second, frame in enumerate(WHO, 1))
    path.write_text("".join(frames))
    return str(path)


def add(folder: Path, name: str, revision: str, more: str = "") -> None:
    (folder / name).write_text(TEXT.replace(REVISION, f"RevisionNumber={revision}") + more)


def choice(folder: Path, revision: int | None = 0x10000) -> str:
    found = EdsFolder([folder]).choose(5, EdsIdentity(0, PRODUCT, revision))
    return "" if found is None else found.text.replace(f"{folder}/", "")


def test_the_file_of_the_node_that_was_heard_gives_its_names(folder: Path, log: str) -> None:
    result = canmon("dump", log, "--eds-dir", str(folder), "-F", "tpdo1")
    assert "5 tpdo1 statusword=0x0237[operation enabled]" in result.stdout
    said = f"node 5: EDS {folder}/drive.eds (vendor 00000000h, product 00006210h)"
    assert result.stderr.splitlines()[0] == said
    assert "EDS" not in "".join(result.stderr.splitlines()[1:])


def test_a_file_that_is_named_goes_before_the_folder(folder: Path, log: str) -> None:
    named = folder.parent / "mine.eds"
    named.write_text(TEXT.replace("=Position actual value", "=Way"))
    words = ("--eds-dir", str(folder), "--eds", f"1-5={named}", "-F", "tpdo1")
    result = canmon("dump", log, *words)
    assert "way=1234" in result.stdout
    assert "node 5: EDS" not in result.stderr


@pytest.mark.parametrize("small", [0, 1 << 20])
def test_the_board_has_the_name_of_the_file(
    folder: Path, log: str, small: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", small)
    result = canmon("nodes", log, "--eds-dir", str(folder))
    assert result.stdout.splitlines()[1].split()[:2] == ["5", "EPOS"]
    assert result.stderr.count("node 5: EDS") == 1


def test_where_none_fits_it_is_said_once(folder: Path, log: str) -> None:
    (folder / "drive.eds").unlink()
    said = canmon("dump", log, "--eds-dir", str(folder), "-F", "tpdo1").stderr
    wanted = f"node 5: no EDS in {folder} for vendor 00000000h, product 00006210h\n"
    assert said.count("no EDS") == 1
    assert wanted in said


@pytest.mark.parametrize(
    ("revision", "more", "reason"),
    [
        ("0x00020000", "", "it has the revision of the node"),
        ("0x00010000", "[DeviceComissioning]\nNodeID=9\n", "the other is of a node"),
        ("0x00010000", "", "first by name"),
    ],
)
def test_of_two_that_fit_the_better_is_taken_and_it_is_said_why(
    folder: Path, revision: str, more: str, reason: str
) -> None:
    add(folder, "elder.eds", revision, more)
    said = "; also fits: elder.eds; preferred: "
    who = "(vendor 00000000h, product 00006210h, revision 00010000h)"
    assert choice(folder) == f"drive.eds {who}{said}{reason}"


def test_the_nearest_revision_is_taken_and_a_wrong_one_is_said(folder: Path) -> None:
    (folder / "drive.eds").unlink()
    add(folder, "a.eds", "0x00030000")
    add(folder, "b.eds", "0x00010002")
    add(folder, "c.eds", "0x00010001")
    assert "c.eds " in choice(folder)
    assert "it is of revision 00010001h; also fits: b.eds, a.eds; preferred:" in choice(folder)
    assert choice(folder).endswith("its revision is the nearest")
    (folder / "c.eds").unlink()
    assert choice(folder).endswith("it has the major revision of the node")
    assert choice(folder, None).startswith("a.eds ")
    assert choice(folder, None).endswith("the latest revision; that of the node is unknown")


def test_a_dcf_of_this_node_goes_before_its_eds(folder: Path) -> None:
    add(folder, "left.dcf", "0x00010000", "[DeviceComissioning]\nNodeID=0x05\n")
    assert choice(folder).startswith("left.dcf ")
    assert choice(folder).endswith("preferred: it is the DCF of node 5")


def test_a_file_is_chosen_again_when_the_revision_comes(folder: Path) -> None:
    add(folder, "elder.eds", "0x00020000")
    said: list[str] = []
    files = EdsFiles({}, EdsFolder([folder]), said.append)
    assert files.find("can0", 5, EdsIdentity(0, PRODUCT)) is not None
    assert files.find("can0", 5, EdsIdentity(0, PRODUCT, 0x10000)) is not None
    assert files.find("can0", 5, EdsIdentity(0, PRODUCT, 0x10000)) is None
    assert [line.partition(" (")[0] for line in said] == [
        f"node 5: EDS {folder}/elder.eds",
        f"node 5: EDS {folder}/drive.eds",
    ]


def test_an_xdd_is_known_by_its_identity(folder: Path) -> None:
    (folder / "drive.xdd").write_text(XDD)
    candidates = list(EdsFolder([folder])._read())
    (found,) = [one.identity for one in candidates if one.path.suffix == ".xdd"]
    assert found.vendor
    chosen = EdsFolder([folder]).choose(5, found)
    assert chosen is not None
    assert chosen.path.name == "drive.xdd"


def test_a_folder_that_is_none_is_refused(log: str, tmp_path: Path) -> None:
    for verb in ("dump", "top", "nodes", "check --no-emcy", "tui"):
        result = canmon(*verb.split(), log, "--eds-dir", str(tmp_path / "no"))
        assert result.exit_code == 2
        assert result.stderr == f"Error: --eds-dir {tmp_path}/no: No such file or directory\n"
    result = canmon("dump", log, "--eds-dir", log)
    assert result.stderr == f"Error: --eds-dir {log}: Not a directory\n"


def test_a_range_of_nodes_has_one_file(log: str) -> None:
    for word in ("3-2=x", "0-3=x", "1-200=x"):
        result = canmon("nodes", log, "--eds", word)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"Error: --eds {word!r} is not NODE=FILE with a node-ID")
    rows = canmon("nodes", log, "--eds", f"5-7={EPOS}").stdout.splitlines()
    assert [row.split()[0] for row in rows[1:4]] == ["5", "6", "7"]


RIG = '[device.drive]\ntype = "epos"\nnode_id = 5\n'


@pytest.fixture
def rig(tmp_path: Path) -> str:
    path = tmp_path / "bench.toml"
    path.write_text(RIG)
    return str(path)


def test_net_reads_who_the_node_is(folder: Path, rig: str) -> None:
    (folder / "drive.eds").write_text(TEXT.replace("=Position actual value", "=Way"))
    result = canmon("net", rig, "read", "5", "way", "--eds-dir", str(folder))
    assert result.stdout == "6064h:00 way = 0 (0x00000000)\n"
    assert f"node 5: EDS {folder}/drive.eds (vendor 00000000h, product 00006210h" in result.stderr
    (folder / "drive.eds").unlink()
    result = canmon("net", rig, "read", "5", "statusword", "--eds-dir", str(folder))
    assert f"node 5: no EDS in {folder} for vendor 00000000h" in result.stderr
    assert result.stdout.startswith("6041h:00 statusword")


def test_net_boot_and_conform_take_the_file_of_the_node(folder: Path, rig: str) -> None:
    words = ("--eds-dir", str(folder))
    result = canmon("net", rig, "boot", "5", *words)
    assert result.exit_code == 0, result.stderr
    assert "no --eds" not in result.stderr
    result = canmon("conform", rig, "--node", "5", "--only", "OD-1018*", *words)
    assert f"node 5: EDS {folder}/drive.eds" in result.stderr
    assert "drive.eds" in result.stdout


def test_one_file_or_a_folder(folder: Path, rig: str) -> None:
    result = canmon("net", rig, "read", "5", "--eds", str(EPOS), "--eds-dir", str(folder))
    assert result.exit_code == 2
    assert result.stderr == "Error: --eds and --eds-dir: which file? give one of them\n"


def test_send_asks_the_node_who_it_is(folder: Path, wire: Wire) -> None:
    answers = dict(zip(WHO[:6:2], WHO[1:6:2], strict=True))
    words = ("5.rpdo1", "controlword=15", "--eds-dir", str(folder))
    with wire.answering(lambda frame: answers.get(frame, "")):
        result = canmon("send", wire.word, *words)
    assert result.exit_code == 0, result.stderr
    assert " 205#0F00" in result.stdout
    with wire.answering(lambda frame: ""):
        result = canmon("send", wire.word, *words)
    assert result.exit_code == 2
    assert "node 5 does not send vendor and product (1018h); give --eds 5=FILE" in result.stderr


def test_a_name_that_commands_a_terminal_is_inert(folder: Path, log: str) -> None:
    (folder / "drive.eds").rename(folder / "a\x1b[31m\nb.eds")
    said = canmon("dump", log, "--eds-dir", str(folder), "-F", "tpdo1").stderr
    assert "\x1b" not in said
    assert "a\N{SYMBOL FOR ESCAPE}[31m\N{SYMBOL FOR LINE FEED}b.eds (vendor" in said.splitlines()[0]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[DeviceInfo]\n",
        "[DeviceInfo]\nVendorNumber=x\nProductNumber=\n",
        "[DeviceInfo]\nVendorNumber=99999999999999\n",
        "[1018sub1]\nDefaultValue=$NODEID\n",
        "[DeviceInfo\n[[[[",
    ],
)
def test_a_file_that_does_not_say_whom_it_is_for_fits_nobody(folder: Path, text: str) -> None:
    (folder / "odd.eds").write_text(text)
    assert choice(folder).startswith("drive.eds (")
    assert "odd.eds" not in choice(folder)
