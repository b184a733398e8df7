from __future__ import annotations

import resource
from pathlib import Path

import pytest

from tickrig.emulators.testing.campaign.journal import CampaignJournal, JournalFullError
from tickrig.emulators.testing.campaign.order import CampaignRefusal, RunVerdict

HEAD = {"tests": ["t.py::test_a", "t.py::test_b"], "seeds": "0-9"}
VERDICTS = [
    RunVerdict(4, "passed", 1_000_000),
    RunVerdict(0, "failed", 1_500_000, "t.py:7", "AssertionError: µ\n"),
    RunVerdict(3, "hung", 0, "", "no verdict within 60 s"),
]


def written(path: Path) -> bytes:
    journal = CampaignJournal(path, HEAD)
    assert journal.add(VERDICTS[:2]) == VERDICTS[:2]
    assert journal.add(VERDICTS) == VERDICTS[2:]
    journal.close()
    return path.read_bytes()


def kept(path: Path) -> list[RunVerdict]:
    journal = CampaignJournal(path, HEAD)
    journal.close()
    return list(journal.verdicts.values())


def test_a_new_process_has_all_verdicts(tmp_path: Path) -> None:
    path = tmp_path / "j"
    whole = written(path)
    assert kept(path) == VERDICTS
    assert path.read_bytes() == whole


def test_what_power_loss_has_torn_is_done_again(tmp_path: Path) -> None:
    path = tmp_path / "j"
    whole = written(path)
    for at in range(len(whole)):
        lines = max(0, whole[:at].count(b"\n") - 1)
        for left in (whole[:at], whole[:at].ljust(len(whole), b"\0"), whole[:at] + b"\xff\n7 "):
            path.write_bytes(left)
            assert kept(path) == VERDICTS[:lines], left
            assert kept(path) == VERDICTS[:lines]  # it was mended
            journal = CampaignJournal(path, HEAD)
            journal.add(VERDICTS)
            journal.close()
            assert kept(path) == VERDICTS


def test_a_line_whose_bits_are_wrong_is_no_line(tmp_path: Path) -> None:
    path = tmp_path / "j"
    whole = written(path)
    path.write_bytes(whole.replace(b"passed", b"failed"))
    assert kept(path) == VERDICTS[1:]


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ({**HEAD, "seeds": "0-99"}, "is of a campaign with seeds 0-9; now 0-99: --fresh starts"),
        ({**HEAD, "tests": ["t.py::test_c"]}, "with tests t.py::test_a, t.py::test_b; now t.py"),
        ({**HEAD, "rig file": "rig.toml"}, "with rig file None; now rig.toml"),
    ],
)
def test_another_campaign_is_refused(tmp_path: Path, head: dict[str, object], said: str) -> None:
    whole = written(tmp_path / "j")
    with pytest.raises(CampaignRefusal, match=said):
        CampaignJournal(tmp_path / "j", head)
    assert (tmp_path / "j").read_bytes() == whole


def test_two_do_not_write_one_journal(tmp_path: Path) -> None:
    journal = CampaignJournal(tmp_path / "j", HEAD)
    with pytest.raises(CampaignRefusal, match="another campaign runs that writes it"):
        CampaignJournal(tmp_path / "j", HEAD)
    (tmp_path / "j").write_bytes(b"torn")  # so that it is written anew
    journal.close()
    journal = CampaignJournal(tmp_path / "j", HEAD)
    with pytest.raises(CampaignRefusal, match="another campaign runs that writes it"):
        CampaignJournal(tmp_path / "j", HEAD)
    journal.remove()
    assert not (tmp_path / "j").exists()


def test_a_full_disk_keeps_what_is_there(tmp_path: Path) -> None:
    path = tmp_path / "j"
    journal = CampaignJournal(path, HEAD)
    journal.add(VERDICTS[:1])
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 20, before[1]))
    try:
        with pytest.raises(JournalFullError) as caught:
            journal.add(VERDICTS[1:])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (caught.value.filename, list(journal.verdicts)) == (str(path), [4])
    journal.close()
    assert kept(path) == VERDICTS[:1]
