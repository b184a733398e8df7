"""The compiled build: which modules it compiles, and that it does what the pure one does."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import subprocess
import sys
import tomllib
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Final

import pytest

import tickrig
from tests.device.canopen.profile_objects import DRIVE, make_dictionary
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.wire.can import CanFrame

ROOT: Final = Path(__file__).parents[1]
TABLE: Final = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["tickrig"]
ROOMS: Final[list[str]] = TABLE["compiled"]["rooms"]
LEFT_OUT: Final[dict[str, str]] = TABLE["compiled"]["left-out"]


def found(pattern: str) -> set[Path]:
    return {path for path in ROOT.glob(pattern) if path.stem != "__init__"}


def compiled_modules() -> list[str]:
    paths = set().union(*map(found, ROOMS)) - set().union(*map(found, LEFT_OUT))
    return sorted("tickrig." + ".".join(p.relative_to(ROOT).with_suffix("").parts) for p in paths)


@pytest.mark.parametrize("pattern", [*ROOMS, *LEFT_OUT])
def test_each_line_of_the_list_names_modules(pattern: str) -> None:
    assert found(pattern)


def test_what_is_left_out_would_be_compiled_otherwise_and_has_a_reason() -> None:
    assert set().union(*map(found, LEFT_OUT)) <= set().union(*map(found, ROOMS))
    assert all(LEFT_OUT.values())


def test_the_pure_floors_are_compiled() -> None:
    assert {"wire/**/*.py", "device/**/*.py"} <= set(ROOMS)


def test_an_installation_is_compiled_whole_or_not_at_all() -> None:
    for name in compiled_modules():
        spec = importlib.util.find_spec(name)
        assert spec is not None
        assert str(spec.origin).endswith(tuple(EXTENSION_SUFFIXES)) is tickrig.compiled, name


def test_a_compiled_module_has_its_source_beside_it() -> None:
    package = Path(tickrig.__file__).parent
    for name in compiled_modules():
        assert (package.parent / name.replace(".", "/")).with_suffix(".py").is_file()


def history(seconds: int) -> str:
    """Run two drives and a master that moves one of them; a hash over (time, frame)."""
    wire, heard = CanWire(), hashlib.sha256()
    wire.observers.append(lambda at_us, frame: heard.update(f"{at_us} {frame}\n".encode()))
    plain = make_slave(make_dictionary({DRIVE}), 5, application=Ds402)
    rig = Rig(*(Station(device, wire.end()) for device in (plain, make_epos(6))))
    master = wire.end()
    rig.run_for(100_000)
    for text in ("000#0100", *(f"606#2B406000{word}000000" for word in ("06", "07", "0F"))):
        master.send(rig.now_us, (CanFrame.parse(text),))
        rig.run_for(10_000)
    for text in ("606#2F60600003000000", "606#23FF6000E8030000", "606#4064600000000000"):
        master.send(rig.now_us, (CanFrame.parse(text),))
        rig.run_for(seconds * 300_000)
    return heard.hexdigest()


def test_both_builds_do_the_same() -> None:
    assert history(3) == "4a0f71aba09b197fc5d78be7089e0f1b147d7ab9d1b47a2e74a970da97fa6a9c"


def test_a_source_tree_stays_pure_where_a_wheel_would_be_compiled(tmp_path: Path) -> None:
    """`TICKRIG_COMPILE` counts for wheels alone."""
    code = "import setup; print(setup.extensions())"
    asked = [sys.executable, "-c", code, "--name"]
    environment = os.environ | {"TICKRIG_COMPILE": "1"}
    done = subprocess.run(
        asked, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout.splitlines()[-1:] == ["[]"], done.stderr
