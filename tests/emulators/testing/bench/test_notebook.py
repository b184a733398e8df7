"""What Jupyter shows of a bench; docs/howto/jupyter.md runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from tests.emulators.testing.report.html_tree import Element, parse_page
from tests.test_docs import blocks
from tickrig import Bench, read_trace

PAGE = "docs/howto/jupyter.md"
HOSTILE = b"</pre><script>alert(1)</script><img src=x onerror=alert(1)>\x1b[31m\xe2\x80\xae\n"


def html_of(shown: Any) -> Element:
    return parse_page(shown._repr_html_())


@pytest.fixture
def bench() -> Bench:
    bench = Bench(rrc="rrc", left="5=epos", seed=1)
    bench.run_for("100ms")
    bench.press("rrc/power_button")
    link = bench["rrc"].link
    link.send(HOSTILE)
    bench.run_for("1s")
    return bench


def test_a_bench_has_its_devices_and_the_values_of_its_signals(bench: Bench) -> None:
    page = html_of(bench)
    rows = [[cell.text for cell in row.all("td")] for row in page.all("tr")]
    assert ["rrc", "rrc"] in rows
    assert ["left", "can"] in rows
    assert ["rrc/state", "Standby", "", "state of the RRC"] in rows
    assert "virtual time · 1.100000 s" in page.text
    assert "objects of CANopen nodes" in page.text
    bench.close()
    assert html_of(bench).text == page.text


def test_a_device_of_a_bench_has_its_own_signals(bench: Bench) -> None:
    page = html_of(bench["rrc"])
    rows = [[cell.text for cell in row.all("td")] for row in page.all("tr")]
    assert ["state", "Standby", "", "state of the RRC"] in rows
    assert "shaft_deg" not in page.text


@pytest.mark.realtime
def test_a_bench_in_real_time_is_shown_too() -> None:
    with Bench("rrc", mode="real") as bench:
        assert "real time" in html_of(bench).text
        assert "state of the RRC" in html_of(bench["rrc"]).text


def test_what_can_be_done_is_a_table_for_each_kind(bench: Bench) -> None:
    page = html_of(bench["rrc"].describe())
    assert [one.text.split()[0] for one in page.all("summary")] == [
        *("Outputs", "Inputs", "Faults", "Groups")
    ]
    assert ["stick", "stick_v_pct stick_w_pct"] in [
        [cell.text for cell in row.all("td")] for row in page.all("tr")
    ]


@pytest.mark.parametrize("what", ["transcript", "trace"])
def test_hostile_text_of_a_wire_is_text(bench: Bench, what: str) -> None:
    page = html_of(getattr(bench, what)())
    tags = {element.tag for element in page.below()}
    assert not tags & {"script", "img", "a", "iframe"}
    assert not [key for one in page.below() for key in one.attributes if key.startswith("on")]
    assert "<script>alert(1)</script>" in page.text
    assert not set("\x1b\u202e") & set(page.text)


def test_a_transcript_is_a_text_as_before(bench: Bench) -> None:
    assert isinstance(bench.transcript(), str)
    assert bench.transcript().splitlines()[0] == "0.001055 can < 705#00"


def test_a_long_trace_is_cut_with_a_count() -> None:
    with Bench("5=epos") as bench:
        for number in range(300):
            bench.set("load_nm", number / 1e3)
            bench.run_for("1ms")
        page = html_of(bench.trace())
    assert len(page.all("tr")) < 210
    assert " more" in page.text


def test_a_trace_is_a_table_of_pandas(bench: Bench, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    bench.save_trace(tmp_path / "run.trace")
    frame = read_trace(tmp_path / "run.trace").to_pandas()
    pandas.testing.assert_frame_equal(frame, bench.trace().to_pandas())
    boot = frame[frame.name == "left"].iloc[0]
    assert (boot.mark, boot.text, boot.data, boot.can_id) == ("<", "705#00", b"\0", 0x705)
    pressed = frame[frame.input == "power_button"]
    assert list(pressed.value) == [1, 0]
    assert list(pressed.at_us) == [110_000, 210_000]
    assert pressed.index[0] == 0.11
    assert HOSTILE in list(frame.data)


def test_an_empty_trace_is_an_empty_table(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    (tmp_path / "run.trace").write_text('# tickrig-trace v1 rrc {"seed": 0}\n2.000000 .\n')
    frame = read_trace(tmp_path / "run.trace").to_pandas()
    assert (len(frame), "can_id" in frame.columns) == (0, True)


def test_without_pandas_it_is_said_what_to_install(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"pip install 'tickrig\[pandas\]'"):
        bench.trace().to_pandas()


def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks(PAGE, "python"):
        exec(compile(block, PAGE, "exec"), names)
    assert len(names["answers"]) == 2
