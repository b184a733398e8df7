from __future__ import annotations

import json
from pathlib import Path
from xml.etree.ElementTree import parse

import pytest

from tickrig.device import make_epos
from tickrig.host.canopen.conform.verdict import Report
from tickrig.testing import conformance, conformance_text, write_conformance
from tickrig.wire.can import CanFrame, Frames


class Deaf:
    """A slave of ours that hears no NMT command."""

    def __init__(self) -> None:
        self._slave, self.node_id, self.tick_us = make_epos(5), 5, 1_000

    @property
    def due_us(self) -> int:
        return self._slave.due_us

    def reset(self) -> None:
        self._slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        return self._slave.tick(now_us, tuple(filter(self._hears, rx)))

    def _hears(self, frame: CanFrame) -> bool:
        return frame.can_id != 0


@pytest.fixture(scope="module")
def report() -> Report:
    return conformance(Deaf(), only=("NMT-03", "UE-01"))


@pytest.fixture
def known(report: Report, tmp_path: Path) -> str:
    path = tmp_path / "known.txt"
    write_conformance(report, path)
    return str(path)


def test_the_text_is_that_of_the_command(report: Report, known: str) -> None:
    text = conformance_text(report)
    assert "FAIL NMT-03: Start remote node" in text
    assert "000   [2]  01 05" in text, "the frames are decoded"
    assert text.endswith("2 checks: 1 pass, 1 fail\n")
    assert conformance_text(report, baseline=known).endswith("1 failure known, 0 new\n")


def test_the_ending_says_what_is_written(report: Report, known: str, tmp_path: Path) -> None:
    for name in ("r.html", "r.xml", "r.svg", "r.json"):
        write_conformance(report, str(tmp_path / name), baseline=known)
    assert "Start remote node" in (tmp_path / "r.html").read_text("utf-8")
    assert len(parse(tmp_path / "r.xml").findall(".//skipped")) == 1, "the failure is known"
    assert (tmp_path / "r.svg").read_text().startswith("<svg")
    assert json.loads((tmp_path / "r.json").read_text())["counts"]["fail"] == 1
    assert Path(known).read_text().splitlines()[1].startswith("NMT-03  # Start remote node")


def test_what_cannot_be_written_is_told(report: Report, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"r\.pdf: unknown format, .*\.html, \.xml"):
        write_conformance(report, tmp_path / "r.pdf")
    with pytest.raises(OSError, match="nosuch"):
        write_conformance(report, tmp_path / "nosuch" / "r.html")
    with pytest.raises(OSError, match="nosuch"):
        conformance_text(report, baseline=tmp_path / "nosuch")


def test_a_report_that_is_printed_fits_a_screen(report: Report) -> None:
    assert "node_id=5" in repr(report)
    assert len(repr(report)) < 1_000
