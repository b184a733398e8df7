"""The page of `canmon report` in a real browser: Debian's chromium, driven by playwright.

Both are left out where they are not installed (apt-get install chromium; pip install playwright).
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from click.testing import CliRunner

from tests.host.canmon.verbs.test_report import HOSTILE, LOG, MAPPING
from tickrig.host.canmon.cli import main

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUM = shutil.which("chromium")
EPOS = Path(__file__).parents[4] / "examples" / "eds" / "epos.eds"

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the page of a log with faults, and an EDS with markup in its names."""
    folder = tmp_path_factory.mktemp("report")
    log, eds, page = folder / "run.log", folder / "evil.eds", folder / "run.html"
    lines = sorted((LOG + MAPPING).splitlines(True))
    log.write_text("".join(lines).replace("183#", "183#3702"))
    text = EPOS.read_text("latin-1")
    eds.write_text(re.sub("(?m)^ProductName=.*$", f"ProductName={HOSTILE}", text), "utf-8")
    words = ["report", str(log), "-o", str(page), "--eds", f"7={eds}", "-b", "500k"]
    assert CliRunner().invoke(main, words).exit_code == 0
    return page


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture
def page(browser: Browser, path: Path) -> Iterator[Page]:
    """Open the page; what it says on the console or asks of a network fails the test."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    opened, said = context.new_page(), list[str]()
    opened.on("console", lambda message: said.append(message.text))
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.on("dialog", lambda dialog: said.append(dialog.message))
    opened.on("request", lambda request: said.append(request.url))
    opened.goto(path.as_uri())
    yield opened
    context.close()
    assert said == [path.as_uri()]


def abort(page: Page) -> int:
    """Return the number of the finding about the aborted transfer."""
    rules = page.locator(".finding .rule").all_text_contents()
    return rules.index("no-sdo-abort")


def test_a_click_on_a_finding_shows_its_frames(page: Page) -> None:
    assert page.locator(".frames").count() == 0
    page.locator(".finding").nth(abort(page)).click()
    here = page.locator(".frames tr.here").all_text_contents()
    assert any("583#8099990000000206" in row for row in here)
    assert page.locator(".frames tr").count() > 10
    assert page.locator("#chart path.chosen").count() == 1
    page.locator(".frames button").click()
    assert page.locator("#span").inner_text().startswith("0.5")
    page.locator(".finding").nth(abort(page)).click()
    assert page.locator(".frames").count() == 0


def test_a_click_on_a_mark_opens_the_finding(page: Page) -> None:
    page.locator("#chart path.found").nth(abort(page)).dispatch_event("click")
    assert page.locator(".finding[aria-expanded=true] .rule").inner_text() == "no-sdo-abort"


def test_keys_zoom_move_and_go_from_finding_to_finding(page: Page) -> None:
    whole = page.locator("#span").inner_text()
    page.locator("#chart").focus()
    page.keyboard.press("+")
    near = page.locator("#span").inner_text()
    page.keyboard.press("ArrowRight")
    assert len({whole, near, page.locator("#span").inner_text()}) == 3
    page.keyboard.press("0")
    assert page.locator("#span").inner_text() == whole
    page.keyboard.press("n")
    page.keyboard.press("n")
    assert page.locator(".finding").nth(1).get_attribute("aria-expanded") == "true"
    page.keyboard.press("p")
    assert page.locator(".finding").nth(0).get_attribute("aria-expanded") == "true"
    page.keyboard.press("Escape")
    assert page.locator(".frames").count() == 0


def test_a_drag_zooms_and_hovering_tells_values(page: Page) -> None:
    page.locator("#timeline").scroll_into_view_if_needed()
    box = page.locator("#chart svg").bounding_box()
    assert box
    middle = box["x"] + box["width"] / 2, box["y"] + 60
    page.mouse.move(*middle)
    assert "Load" in page.locator("#tip").inner_text()
    page.mouse.down()
    page.mouse.move(middle[0] + 100, middle[1])
    page.mouse.up()
    assert float(page.locator("#span").inner_text().split()[0]) > 1


def test_search_and_node_leave_out_the_rest(page: Page) -> None:
    every = page.locator(".finding").count()
    page.keyboard.press("/")
    page.keyboard.type("abort")
    assert 0 < page.locator(".finding").count() < every
    page.keyboard.press("Escape")
    page.select_option("#node", "can0/7")
    assert page.locator(".finding").count() == 0
    assert "Node 3" not in page.locator("#chart").inner_text()


def test_names_of_an_eds_are_text(page: Page) -> None:
    assert "<img src=x" in page.locator("#node-table").inner_text()
    assert page.locator("img").count() == 0


@pytest.fixture(scope="module")
def doubled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the page of two nodes with one node-ID, one EMCY, and a drive that stands still."""
    log = tmp_path_factory.mktemp("doubled") / "run.log"
    beats = [(n * 100_000 + more, "711#05") for n in range(1, 60) for more in (0, 37_000)]
    words = [
        (n * 100_000 + 50_000, f"183#{'3702' if n < 30 else '4002'}00000000") for n in range(60)
    ]
    lines = sorted([*beats, *words, (2_500_000, "091#1023810000000000")])
    log.write_text("".join(f"({1e9 + at_us / 1e6:.6f}) can0 {frame}\n" for at_us, frame in lines))
    page = log.with_suffix(".html")
    command = ["report", str(log), "-o", str(page), "--eds", f"3={EPOS}", "-b", "500k"]
    assert CliRunner().invoke(main, command).exit_code == 0
    return page


def test_a_finding_of_many_times_is_one_bar(browser: Browser, doubled: Path) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto(doubled.as_uri())
    rules = page.locator(".finding .rule").all_text_contents()
    assert {"doubled-node", "no-emcy"} <= set(rules)
    assert page.locator("#chart path.found.many").count() == 1
    bar, mark = (
        page.locator(f"#chart path[data-mark='{rules.index(rule)}']").bounding_box()
        for rule in ("doubled-node", "no-emcy")
    )
    assert bar
    assert mark
    assert bar["width"] > 20 * mark["width"]
    assert mark["y"] + mark["height"] <= bar["y"]
    page.locator("#chart path.found.many").dispatch_event("click")
    assert page.locator(".finding[aria-expanded=true] .rule").inner_text() == "doubled-node"
    page.close()


def test_the_timeline_explains_itself(browser: Browser, doubled: Path) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto(doubled.as_uri())
    legend = page.locator("#legend")
    assert {"operation enabled", "switch on disabled"} <= set(
        legend.locator("span").all_inner_texts()
    )
    colours = {
        name: legend.locator("span", has_text=name)
        .locator("i")
        .evaluate("one => getComputedStyle(one).backgroundColor")
        for name in ("operation enabled", "switch on disabled")
    }
    drawn = page.locator("#chart g rect.s0").evaluate("one => getComputedStyle(one).fill")
    assert drawn == colours["switch on disabled"]
    assert len(set(colours.values())) == 2
    assert "always 0" in page.locator("#chart").inner_text()
    assert page.locator("#chart path.line").count() == 0
    assert re.search(r"max [0-9.]+ %\s*in [0-9.]+ ms", page.locator("#chart").text_content() or "")
    page.close()


@pytest.mark.parametrize("width", [360, 500, 768])
def test_all_of_a_node_is_seen_on_a_small_screen(
    browser: Browser, doubled: Path, width: int
) -> None:
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.goto(doubled.as_uri())
    cell = page.locator("#node-table td", has_text="from two nodes")
    box = cell.bounding_box()
    assert box
    assert box["x"] + box["width"] <= width
    head = cell.evaluate("one => getComputedStyle(one, '::before').content")
    assert head == '"Heartbeat"'
    page.close()


def test_a_finding_has_a_plain_title_and_says_that_it_opens(page: Page) -> None:
    one = page.locator(".finding").nth(abort(page))
    assert one.locator(".title").inner_text() == "Aborted SDO transfers"
    assert one.locator(".open").inner_text() == "show frames"
    one.focus()
    page.keyboard.press("Enter")
    assert page.locator(".finding").nth(abort(page)).get_attribute("aria-expanded") == "true"
    assert page.locator(".finding").nth(abort(page)).locator(".open").inner_text() == "hide frames"
    assert page.locator(".frames tr.here").count() >= 1
    page.keyboard.press("Enter")
    assert page.locator(".frames").count() == 0


def test_paper_shows_ten_frames_of_each_finding(page: Page) -> None:
    page.emulate_media(media="print")
    page.wait_for_selector(".frames table")
    boxes = page.locator("#finding-list > li")
    assert boxes.count() > 2
    for n in range(boxes.count()):
        assert 1 <= boxes.nth(n).locator("tr").count() <= 10
        assert boxes.nth(n).locator("tr.here").count() >= 1
    assert not page.locator(".finding .open").first.is_visible()
    page.emulate_media(media="screen")
    page.wait_for_selector(".frames", state="detached")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 768, 1280])
def test_the_page_is_no_wider_than_the_screen(
    browser: Browser, path: Path, width: int, scheme: str
) -> None:
    context = browser.new_context(viewport={"width": width, "height": 800}, color_scheme=scheme)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(path.as_uri())
    page.locator(".finding").nth(0).click()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(253, 253, 252)") is (scheme == "light")
    context.close()


def test_nothing_is_cut_off_on_paper(page: Page) -> None:
    page.set_viewport_size({"width": 720, "height": 1000})
    page.locator(".finding").nth(abort(page)).click()
    page.emulate_media(media="print")
    assert page.evaluate("document.documentElement.scrollWidth") <= 720
    assert not page.locator("#search").is_visible()
    assert not page.locator(".frames button").is_visible()


def test_chromium_prints_it(path: Path) -> None:
    log, pdf, png = (path.with_name(name) for name in ("run.log", "run.pdf", "run.png"))
    words = ["report", str(log), "--pdf", str(pdf), "--png", str(png)]
    result = CliRunner().invoke(main, words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert pdf.read_bytes().startswith(b"%PDF")
    assert png.read_bytes().startswith(b"\x89PNG")
