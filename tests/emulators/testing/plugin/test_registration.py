"""The plug-in is there when it is installed, costs next to nothing, and can be left out."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint

import pytest

from tests.emulators.testing.plugin.conftest import SRC
from tickrig.emulators.testing.plugin import pytest_plugin

pytest_plugins = ("pytester",)

ROOT = SRC.parent

IMPORTED = """
import json, sys
import pytest
before = set(sys.modules)
import tickrig.emulators.testing.plugin.pytest_plugin
print(json.dumps(sorted(set(sys.modules) - before)))
"""

OURS = {
    "tickrig",
    "tickrig._lazy",
    "tickrig.emulators",
    "tickrig.emulators.testing",
    "tickrig.emulators.testing.plugin",
    "tickrig.emulators.testing.plugin.pytest_plugin",
    "tickrig.emulators.testing.plugin.settings",
    "tickrig.emulators.testing.plugin.stash",
}


@pytest.fixture
def installed(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make an environment in which a distribution has the plug-in's entry point."""
    entry = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    info = pytester.path / "site" / "tickrig_plugin-1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: tickrig-plugin\nVersion: 1\n")
    lines = [f"{name} = {value}\n" for name, value in entry["pytest11"].items()]
    (info / "entry_points.txt").write_text("".join(["[pytest11]\n", *lines]))
    monkeypatch.setenv("PYTHONPATH", f"{SRC}:{info.parent}")
    monkeypatch.delenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", raising=False)
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)


def test_the_entry_point_is_the_module() -> None:
    entry = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    assert EntryPoint("tickrig", entry["pytest11"]["tickrig"], "pytest11").load() is pytest_plugin


def test_it_imports_nothing_but_itself() -> None:
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED],
        env={"PYTHONPATH": str(SRC)},
        capture_output=True,
        text=True,
        check=True,
    )
    names = set(json.loads(done.stdout))
    assert {name for name in names if name.startswith("tickrig")} == OURS
    assert names - OURS <= sys.stdlib_module_names


@pytest.mark.usefixtures("installed")
def test_installed_it_is_there_and_can_be_left_out(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_one(bench):\n    assert bench.devices == ('rrc',)\n")
    pytester.makeconftest(
        "import pytest\n\n@pytest.fixture\ndef bench_config():\n    return 'rrc'\n"
    )
    pytester.runpytest_subprocess().assert_outcomes(passed=1)
    without = pytester.runpytest_subprocess("-p", "no:tickrig")
    without.stdout.fnmatch_lines(["*fixture 'bench' not found"])


@pytest.mark.usefixtures("installed")
def test_in_the_tree_it_is_registered_once_installed_or_not(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT), prepend=os.pathsep)  # it imports tests.soak
    pytester.makeconftest((ROOT / "conftest.py").read_text())
    pytester.makepyfile(
        "def test_one(pytestconfig):\n    assert pytestconfig.pluginmanager.has_plugin('tickrig')\n"
    )
    pytester.runpytest_subprocess().assert_outcomes(passed=1)
    pytester.path.joinpath("site", "tickrig_plugin-1.dist-info", "entry_points.txt").unlink()
    pytester.runpytest_subprocess().assert_outcomes(passed=1)
