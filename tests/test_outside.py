"""A project of somebody else, `tests/outside`, tests its hosts on our bench, beside our wheel."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.environment import ROOT, Environment, make_environment

HARDWARE = """
[hardware]
control = "{folder}/control"

[hardware.kettle]
port = "{url}"
"""
KETTLE = '[device.kettle]\ntype = "kettle"\n'

TRIES = 5

PLANTED = {
    "no time-out": ["test_a_cut_line_is_told"],
    "toggle ignored": ["test_a_segment_that_comes_twice_is_taken_once"],
    "EMCY not handled": ["test_a_motor_that_fails_stops_the_heater"],
    "restart race": ["test_a_motor_that_restarts_is_set_up_again"],
    "wrong COB-ID": ["test_a_motor_that_restarts_is_set_up_again", "test_the_motor_is_set_up"],
    "boot-up lost": ["test_a_boot_up_that_is_lost_is_no_end"],
}
"""Which tests find a mistake."""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """Install our wheel, the kettle and the boiler into an environment of their own."""
    made = make_environment(tmp_path_factory, "stranger", "outside")
    shutil.copytree(ROOT / "tests" / "outside", made.folder.parent / "boiler")
    return made


def run(environment: Environment, *options: str, mistake: str = "") -> str:
    """Run the project's tests; return what pytest printed."""
    words = ("pytest", "-q", "-p", "no:cacheprovider", "-p", "no:randomly", "-rf", *options)
    done = subprocess.run(
        words,
        cwd=environment.folder.parent / "boiler",
        env={**environment.variables, "BOILER_MISTAKE": mistake},
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )
    return done.stdout + done.stderr


def failed(said: str) -> list[str]:
    return sorted(re.findall(r"^FAILED tests/\w+\.py::(\w+)", said, re.MULTILINE))


def test_its_tests_pass_in_virtual_time(environment: Environment) -> None:
    said = run(environment)
    assert "10 passed" in said, said


@pytest.mark.parametrize("mistake", PLANTED)
def test_a_mistake_in_its_hosts_is_found(environment: Environment, mistake: str) -> None:
    said = run(environment, mistake=mistake)
    assert failed(said) == PLANTED[mistake], said
    assert "0 errors" in said or " error" not in said.splitlines()[-1]


def run_until_judged(environment: Environment, *options: str) -> str:
    """Run the tests until the machine was quick enough for all, and return what pytest printed."""
    for _ in range(TRIES):
        said = run(environment, *options)
        assert failed(said) == [], said
        if "too slow" not in said:
            break
    return said


@pytest.mark.realtime
def test_its_tests_pass_in_real_time(environment: Environment) -> None:
    assert "10 passed" in (said := run_until_judged(environment, "--bench-mode", "real")), said


@pytest.mark.realtime
def test_its_tests_pass_over_rfc_2217(environment: Environment, tmp_path: Path) -> None:
    emu = ("tickrig", "emu", "kettle", "--serve", "rfc2217://0", "--control", "control")
    with environment.start(*emu, cwd=tmp_path) as process:
        try:
            assert process.stdout is not None
            url = process.stdout.readline().decode().strip()
            rig = tmp_path / "rig.toml"
            rig.write_text(KETTLE + HARDWARE.format(folder=tmp_path, url=url))
            said = run_until_judged(environment, "--bench", str(rig), "--bench-mode", "hardware")
        finally:
            process.terminate()
    assert "4 passed, 6 skipped" in said, said
