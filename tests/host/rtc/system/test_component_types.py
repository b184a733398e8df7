"""Component types of an installed package: found by name, and what is broken is one line."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from tickrig.emulators.commands.cli import main
from tickrig.host.rtc import Manager, RtComponent, RtcRefused
from tickrig.host.rtc.system.manager import COMPONENT_TYPES
from tickrig.host.rtc.system.system import describe
from tickrig.host.rtc.system.system_file import parse_toml, write_toml

MODULE = """\
from tickrig.host.rtc import InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types.rtc import TimedLong


class Doubler(RtComponent):
    spec = ModuleSpec("Doubler", "Twice what arrives")

    def __init__(self, instance_name):
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedLong))
        self.out = self.add_port(OutPort("out", TimedLong))

    def on_execute(self, ec):
        while self.in_.is_new:
            value = self.in_.read()
            self.out.write(TimedLong(value.tm, 2 * value.data))
        return ReturnCode.RTC_OK


class Fragile(RtComponent):
    spec = ModuleSpec("Fragile")

    def __init__(self, instance_name):
        raise RuntimeError("in two")


class Nameless(RtComponent):
    pass
"""
POINTS = """\
[tickrig.components]
Doubler = doubling:Doubler
Twice = doubling:Doubler
Fragile = doubling:Fragile
Nameless = doubling:Nameless
Number = doubling:TimedLong
Missing = doubling:Tripler
Gone = no_such_module:Gone
ConsoleIn = doubling:Doubler
"""
PACKAGE = "of package doubling"
NO_TYPE = "no component type 'Tripler'; known: "
LINES = [
    ("Twice", "component type 'Twice' calls itself 'Doubler'"),
    ("Nameless", f"component type 'Nameless' {PACKAGE} (doubling:Nameless) is not an RtComponent"),
    ("Number", f"component type 'Number' {PACKAGE} (doubling:TimedLong) is not an RtComponent"),
    ("Missing", f"component type 'Missing' {PACKAGE} (doubling:Tripler): AttributeError: "),
    ("Gone", f"component type 'Gone' {PACKAGE} (no_such_module:Gone): ModuleNotFoundError: "),
]
SYSTEM = """
[[component]]
name = "Doubler0"
type = "{}"
active = true
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install a foreign package of component types."""
    info = tmp_path / "doubling-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: doubling\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(POINTS)
    (tmp_path / "doubling.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "doubling", raising=False)
    return tmp_path


def test_a_foreign_type_is_created_by_its_name(folder: Path) -> None:
    manager = Manager()
    assert "Doubler" in manager.types
    assert "doubling" not in sys.modules
    for name in ("ConsoleIn", "Doubler", "ConsoleOut"):
        manager.create(name)
    assert type(manager.find("ConsoleIn0")).__module__.startswith("tickrig")
    manager.connect("ConsoleIn0.out", "Doubler0.in")
    manager.connect("Doubler0.out", "ConsoleOut0.in")
    manager.activate("ConsoleIn0", "Doubler0", "ConsoleOut0")
    manager.find("ConsoleIn0").enter(21)  # type: ignore[attr-defined]  # a ConsoleIn
    manager.run_for(10_000)
    assert [value.data for value in manager.find("ConsoleOut0").received] == [42]  # type: ignore[attr-defined]


def test_a_system_with_a_foreign_type_is_saved_and_restored(folder: Path) -> None:
    manager = Manager()
    manager.create("Doubler", "D")
    text = write_toml(describe(manager))
    assert parse_toml(text).components[0].type_name == "Doubler"


@pytest.mark.parametrize(("name", "line"), LINES)
def test_what_cannot_be_used_is_one_line(folder: Path, name: str, line: str) -> None:
    with pytest.raises(RtcRefused) as caught:
        Manager().create(name)
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        *LINES,
        ("Fragile", "RuntimeError: in two"),
        ("Tripler", "no component type 'Tripler'; known: "),
    ],
)
def test_a_run_refuses_it_with_the_name_of_the_file(folder: Path, name: str, line: str) -> None:
    file = folder / "system.toml"
    file.write_text(SYSTEM.format(name))
    run = CliRunner().invoke(main, ["rtc", "run", str(file), "--control", str(folder / "ctl")])
    assert run.exit_code == 2
    assert run.stderr.startswith(f"Error: system {file}: {line}")
    assert run.stderr.count("\n") == 1


@pytest.mark.parametrize("name", COMPONENT_TYPES.built_in)
def test_our_types_are_there_by_name(name: str) -> None:
    kind = COMPONENT_TYPES.load(name)
    assert issubclass(kind, RtComponent)
    assert kind.spec.type_name == name


def test_what_is_built_in_is_registered_as_others_register_theirs() -> None:
    project = tomllib.loads((Path(__file__).parents[4] / "pyproject.toml").read_text("utf-8"))
    assert project["project"]["entry-points"]["tickrig.components"] == COMPONENT_TYPES.built_in
