"""The tutorials, word for word, in an environment of their own with our wheel."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.emulators.serial.network.test_network_page import free_ports
from tests.environment import ROOT, Environment, make_environment
from tests.page_runner import PageRunner
from tickrig.emulators.testing.rig_file.reader import read_rig_file

OURS = (
    "the bench has no configuration",
    "nothing will ever happen for which this body waits",
    "a second thread cannot make virtual time pass",
    "the machine was too slow: ",
)
"""What the page on trouble says of us, word for word."""

README = (ROOT / "README.md").read_text("utf-8")
TUTORIALS = sorted({*(ROOT / "docs/tutorials").glob("*.md")} - {ROOT / "docs/tutorials/index.md"})


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    return make_environment(tmp_path_factory)


@pytest.mark.realtime
@pytest.mark.timeout(400)  # many commands, each with its start-up, beside other tests
@pytest.mark.parametrize("page", TUTORIALS, ids=[page.stem for page in TUTORIALS])
def test_a_tutorial_works(page: Path, environment: Environment, tmp_path: Path) -> None:
    runner = PageRunner(environment, tmp_path)
    runner.run(page)
    assert len(runner.typed) > 2
    shutil.rmtree(tmp_path)


@pytest.mark.parametrize("page", ["howto/real-hardware.md", "howto/ci.md"])
def test_the_rig_files_of_a_page_are_right(page: str, tmp_path: Path) -> None:
    runner = PageRunner(Environment(tmp_path), tmp_path)
    runner.write_files(ROOT / "docs" / page)
    for path in tmp_path.glob("*.toml"):
        if path.name != "pyproject.toml":
            read_rig_file(path)


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("page", "programs", "tcp_ports"),
    [
        ("install.md", (), ()),
        ("howto/windows.md", (), ("7000",)),
        ("howto/wireshark.md", ("tshark",), ()),
    ],
)
def test_the_commands_of_a_page_work(
    page: str,
    programs: tuple[str, ...],
    tcp_ports: tuple[str, ...],
    environment: Environment,
    tmp_path: Path,
) -> None:
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"there is no {program}")
    text = (ROOT / "docs" / page).read_text("utf-8")
    for tcp_port, free_port in zip(tcp_ports, free_ports(len(tcp_ports)), strict=True):
        text = text.replace(tcp_port, free_port)
    (tmp_path / "page.md").write_text(text, "utf-8")
    runner = PageRunner(environment, tmp_path)
    runner.run(tmp_path / "page.md")
    assert runner.typed


@pytest.mark.realtime
def test_the_first_commands_of_the_readme_work(environment: Environment, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples" / "chair", tmp_path / "examples" / "chair")
    (block,) = re.findall(r"^Or install .*?```console\n(.*?)^```", README, re.DOTALL | re.MULTILINE)
    make, install, *commands = [line.partition("  #")[0].split() for line in block.splitlines()]
    assert (make[0], install[:2], len(commands)) == ("python3", ["pip", "install"], 2)
    for command in commands:
        environment.run(*command, cwd=tmp_path)


@pytest.mark.realtime
def test_the_commands_of_the_page_on_ci_work(environment: Environment, tmp_path: Path) -> None:
    runner = PageRunner(environment, tmp_path)
    runner.write_files(ROOT / "docs" / "tutorials" / "first-hil-test.md")
    (tmp_path / "test_noise.py").unlink()
    runner.run(ROOT / "docs" / "howto/ci.md")
    assert len(runner.typed) == 2


def test_the_messages_of_the_page_on_trouble_are_there() -> None:
    page = (ROOT / "docs" / "troubleshooting.md").read_text("utf-8")
    sources = "".join(
        path.read_text("utf-8")
        for floor in ("emulators", "host")
        for path in (ROOT / floor).rglob("*.py")
    )
    flat = " ".join(sources.replace('"\n', "").split())
    for message in OURS:
        assert f"`{message}" in page
        assert message.rstrip(". :") in flat, message
