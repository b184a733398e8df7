"""The action for GitHub: it is valid, it is safe, and its steps do what it says."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.action_steps import Runner
from tests.test_containers import ROOT, run, wanted
from tests.test_with_vcan import guest

ACTION = ROOT / "action.yml"


@pytest.fixture
def runner(tmp_path: Path) -> Runner:
    return Runner(tmp_path)


@pytest.mark.release
def test_the_action_is_valid_and_nothing_in_it_can_be_injected() -> None:
    schema = ("--builtin-schema", "vendor.github-actions")
    run(wanted("check-jsonschema"), *schema, ACTION)
    run(wanted("zizmor"), "--quiet", "--offline", "--persona", "pedantic", ACTION)


@pytest.mark.release
@pytest.mark.parametrize("page", ["ci.md", "without-installation.md"])
def test_the_workflows_of_a_page_are_valid(page: str, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "howto" / page).read_text("utf-8")
    (workflow,) = re.findall(r"^```yaml\n(# \.github/.*?)^```", text, re.DOTALL | re.MULTILINE)
    (tmp_path / "workflow.yml").write_text(workflow)
    schema = ("--builtin-schema", "vendor.github-workflows")
    run(wanted("check-jsonschema"), *schema, tmp_path / "workflow.yml")


@guest
@pytest.mark.realtime
def test_a_step_after_the_action_has_socketcan(runner: Runner) -> None:
    outputs = runner.use(ROOT, {"install": "false"})
    assert outputs["where"].endswith(": vcan0 vcan1")
    assert runner.run("with-vcan bash -c 'cat /sys/class/net/vcan?/type'").split() == ["280"] * 2


@guest
@pytest.mark.realtime
def test_a_command_is_run_with_the_options_that_are_given(runner: Runner) -> None:
    options = "--bus can0 --timeout 60 --classic"
    outputs = runner.use(
        ROOT, {"install": "false", "run": "cat /sys/class/net/can0/mtu", "options": options}
    )
    assert outputs["where"].endswith(": can0")
    assert "16" in runner.said.splitlines()


@guest
@pytest.mark.realtime
def test_a_command_that_fails_fails_the_job(runner: Runner) -> None:
    with pytest.raises(subprocess.CalledProcessError) as told:
        runner.use(ROOT, {"install": "false", "run": "false | cat"})
    assert told.value.returncode == 1


def test_what_is_given_is_a_word_and_no_script(runner: Runner) -> None:
    with pytest.raises(subprocess.CalledProcessError) as told:
        runner.use(ROOT, {"install": "false", "options": "--bus can0;touch${IFS}made"})
    assert told.value.returncode == 125
    assert "a name is wanted, as vcan0" in runner.said


@guest
@pytest.mark.release
@pytest.mark.skipif(os.geteuid() != 0, reason="who is not root might be asked for a password")
def test_a_package_that_is_missing_is_installed(runner: Runner) -> None:
    tools = runner.folder / "bin"
    tools.mkdir()
    for tool in [*Path("/usr/sbin").iterdir(), *Path("/usr/bin").iterdir()]:
        if tool.name != "linux.uml" and not (tools / tool.name).is_symlink():
            (tools / tool.name).symlink_to(tool)
    runner.environment |= {"PATH": str(tools), "SHELLOPTS": "xtrace"}
    try:
        runner.use(ROOT, {})
    except subprocess.CalledProcessError:
        if "+ apt-get install" in runner.said:
            raise
        pytest.skip(f"no packages to be had: {runner.said.splitlines()[-1]}")
    assert "apt-get install -y -qq --no-install-recommends user-mode-linux\n" in runner.said
