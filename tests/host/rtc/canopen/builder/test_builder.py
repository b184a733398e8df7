"""What the builder writes is what a DeviceRTC is (DECISION K17)."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.device.canopen.device_rtc import CanopenComponent, make_device_rtc, make_dictionary
from tickrig.emulators.canopen.build import describe_rtc
from tickrig.host.rtc.canopen.builder.build import build
from tickrig.host.rtc.canopen.builder.profile_file import (
    COMPONENT_NAMES,
    EXAMPLE,
    Project,
    parse_project,
)
from tickrig.host.rtc.canopen.commands.builder import main
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.rtc_canopen import object_table

EVERYTHING = """
name = "EveryThing"
version = "2.7"
vendor = 'Some "one"'
product_code = 0x1234
rate_hz = 250
word_bits = 16
strict_cia301 = true
port = [
    {name = "in", direction = "in", type = "Integer", length = 4},
    {name = "short", direction = "in", type = "Character"},
    {name = "SHORT", direction = "out", type = "Short"},
    {name = "inputs", direction = "in", type = "Boolean", length = 2},
    {name = "big", direction = "out", type = "UnsignedLongLong"},
    {name = "real", direction = "out", type = "Double"},
    {name = "small", direction = "out", type = "Float", length = 2},
    {name = "octets", direction = "in", type = "Octet", length = 8},
    {name = "bits", direction = "in", type = "Boolean", length = 3, cob_id = 0x2A5},
    {name = "off", direction = "in", type = "Short"},
    {name = "word", direction = "out", type = "WideCharacter", length = 3, transport = "pdo"},
    {name = "letter", direction = "out", type = "WideCharacter"},
    {name = "sentence", direction = "in", type = "String"},
    {name = "title", direction = "out", type = "WideString", length = 2},
    {name = "letters", direction = "out", type = "WideCharacter", length = 5},
    {name = "numbers", direction = "out", type = "Integer", length = 5},
    {name = "slow", direction = "out", type = "Short", transport = "sdo"},
]
"""
NO_PORTS = 'name = "Nothing"\n'
PROFILES = [EXAMPLE, EVERYTHING, NO_PORTS]
each_profile = pytest.mark.parametrize("text", PROFILES, ids=["example", "everything", "no ports"])

PROGRAM = r"""
#define {upper}_OD_DEFINE
#include "{lower}_od.h"
#include <stdio.h>
#include <inttypes.h>
{lower}_result {lower}_on_initialize(void) {{ return {upper}_RTC_OK; }}
int main(void) {{
    for (size_t at = 0; at < {upper}_OD_COUNT; at++) {{
        const {lower}_od_entry *row = &{lower}_od[at];
        printf("%x %x %x %x %x %" PRIx64 " %s %d\n", (unsigned)row->index, (unsigned)row->sub,
               (unsigned)row->data_type, (unsigned)row->access, (unsigned)row->size, row->number,
               row->text ? row->text : "", row->port != {upper}_NO_PORT);
    }}
    return {lower}_on_initialize();
}}
"""


def component(folder: Path, project: Project) -> type[CanopenComponent]:
    """Return the class of the skeleton."""
    stem = next(name for name in build(project) if name.endswith(".py"))
    space: dict[str, object] = {"__name__": "skeleton"}
    exec(compile((folder / stem).read_text("utf-8"), stem, "exec"), space)
    kind = space[project.profile.type_name]
    assert isinstance(kind, type)
    assert issubclass(kind, CanopenComponent)
    return kind


def written(folder: Path, text: str) -> Project:
    project = parse_project(text)
    for name, content in build(project).items():
        (folder / name).write_text(content, "utf-8")
    return project


@each_profile
def test_the_eds_is_what_the_device_of_the_skeleton_writes(tmp_path: Path, text: str) -> None:
    project = written(tmp_path, text)
    (skeleton,) = tmp_path.glob("*.py")
    described = describe_rtc(f"{skeleton}:{project.profile.type_name}")
    file = skeleton.with_suffix(".eds")
    eds = write_eds(described.template.description, described.info, file_name=file.name)
    assert eds == file.read_text("utf-8")


@each_profile
def test_the_skeleton_has_the_profile_and_runs(tmp_path: Path, text: str) -> None:
    project = written(tmp_path, text)
    kind = component(tmp_path, project)
    assert kind.profile().placed() == project.profile.placed()
    assert kind.strict_cia301 is project.strict_cia301
    slave = make_device_rtc(kind, 16)
    sent = [str(frame) for frame in slave.tick(1_000, ())]
    for number, command in enumerate(("0110", "8010", "0210", "8110"), 2):
        frames = slave.tick(number * 100_000, (CanFrame.parse(f"000#{command}"),))
        sent += [str(frame) for frame in frames if frame.can_id == 0x710]
        sent += [str(frame) for frame in slave.tick(number * 100_000 + 50_000, ())]
    assert sent[0] == sent[-1] == "710#00"


def test_the_skeleton_of_the_example_is_formatted_as_our_code_is(tmp_path: Path) -> None:
    written(tmp_path, EXAMPLE)
    ruff = [sys.executable, "-m", "ruff"]
    subprocess.run([*ruff, "format", "--check", "--isolated", tmp_path], check=True)
    subprocess.run([*ruff, "check", "--isolated", "--select", "E,F,I,D", tmp_path], check=True)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@each_profile
def test_the_header_compiles_and_its_table_is_the_dictionary(tmp_path: Path, text: str) -> None:
    project = written(tmp_path, text)
    (header,) = tmp_path.glob("*.h")
    lower = header.stem.removesuffix("_od")
    (tmp_path / "main.c").write_text(PROGRAM.format(lower=lower, upper=lower.upper()))
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "main.c", "-o", "main"]
    subprocess.run(command, cwd=tmp_path, check=True)
    shown = subprocess.run([tmp_path / "main"], capture_output=True, check=True, text=True)
    ports = {
        (port.index, sub): port.profile.port_type
        for port in project.profile.placed()
        for sub in port.subs
    }
    expected = []
    for row in object_table(project.profile):
        access = row.access.value | 0x80 * row.relative
        kind = ports.get((row.index, row.sub))
        size = kind.max_bytes if kind and kind.element_bits else row.data_type.size
        number = int.from_bytes(row.default, "little") if size else 0
        words = "" if size else row.default.decode()
        expected.append(
            f"{row.index:x} {row.sub:x} {row.data_type:x} {access:x} {size:x}"
            f" {number:x} {words} {int(kind is not None)}"
        )
    assert shown.stdout.splitlines() == expected


@each_profile
def test_the_fragment_is_a_system_definition_of_this_node(tmp_path: Path, text: str) -> None:
    project = written(tmp_path, text)
    (fragment,) = tmp_path.glob("*.yaml")
    (node,) = parse_definition(fragment.read_text("utf-8")).nodes
    assert (node.id, node.name) == (16, f"{project.profile.type_name}0")
    assert (tmp_path / node.eds).exists()
    ports = {port.profile.name: port for port in project.profile.placed()}
    by_sdo = {name for name, port in ports.items() if port.profile.by_sdo}
    assert ({*node.sdo_ports}, {*node.ports.values()}) == (by_sdo, ports.keys() - by_sdo)
    for name, entry in node.sdo_ports.items():
        assert (entry.index, entry.direction) == (ports[name].index, ports[name].profile.direction)
    dictionary = make_dictionary(component(tmp_path, project))
    for pdo, name in node.ports.items():
        parameter = (0x1800 if pdo[0] == "t" else 0x1400) + int(pdo[4:]) - 1
        cob_id = ports[name].cob_id
        assert dictionary[parameter, 1].number == (0x8000_0000 if cob_id is None else cob_id)


def test_names_that_a_component_has_are_known() -> None:
    mine = {
        name
        for name in (*dir(CanopenComponent), *vars(CanopenComponent()))
        if not name.startswith("_")
    }
    assert mine == COMPONENT_NAMES


REFUSED = [
    ("name", "Expected '=' after a key in a key/value pair (at end of document)"),
    ("", "name is missing"),
    ('name = "G"\nrate = 5', "no key rate; known: name, version, vendor, category, rate_hz"),
    ('name = "G"\nrate_hz = "5"', "rate_hz '5' is no whole number"),
    ('name = "G"\nstrict_cia301 = 1', "strict_cia301 1 is neither true nor false"),
    ("name = 5", "name 5 is no text"),
    ('name = "G"\nnode_id = 128', "node_id 128 is not in 1..127"),
    ('name = "class"', "name 'class' is a keyword of Python"),
    ('name = "G"\na = ' + "[" * 20_000, "lists or tables nest too deep"),
    ('name = "G"\nport = 5', "port: ports are tables [[port]]"),
    ('name = "G"\nport = [5]', "port: ports are tables [[port]]"),
    ("{size}", "port 1: no key size; known: name, direction, type, length"),
    ("{direction}", "port 1: direction 'up' is not one of in, out"),
    ("{type}", "port 1: type 'Int' is not one of Boolean, Octet, Character, Short"),
    ("{length}", "port 1: a sequence of 0 elements, at least 1 is needed"),
    ("{name}", "port 1: name is missing"),
    ("{bits}", "port a: 9 x Octet are 72 bits, a PDO has 64 bits; take transport sdo"),
    ("{text}", "port a: String, a PDO has 64 bits; take transport sdo"),
    ("{transport}", "port 1: transport 'can' is not one of pdo, sdo"),
    ("{cob_id}", "port a: cob_id 601h is not in 181h..6DFh, or is one of 581h..5FFh"),
    ("{word}", "port 1: a word of 12 bits; Integer has 8, 16 or 32"),
    ("{twice}", "port 'in' becomes 'in_', and so is another called"),
]
PORTS = {
    "{size}": '{name = "a", size = 1}',
    "{direction}": '{name = "a", direction = "up", type = "Short"}',
    "{type}": '{name = "a", direction = "in", type = "Int"}',
    "{length}": '{name = "a", direction = "in", type = "Short", length = 0}',
    "{name}": '{direction = "in", type = "Short"}',
    "{bits}": '{name = "a", direction = "in", type = "Octet", length = 9, transport = "pdo"}',
    "{text}": '{name = "a", direction = "in", type = "String", transport = "pdo"}',
    "{transport}": '{name = "a", direction = "in", type = "Short", transport = "can"}',
    "{cob_id}": '{name = "a", direction = "in", type = "Short", cob_id = 0x601}',
    "{word}": '{name = "a", direction = "in", type = "Integer"}',
    "{twice}": '{name = "in", direction = "in", type = "Short"},'
    ' {name = "in_", direction = "in", type = "Short"}',
}


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(main, [str(word) for word in words])


@pytest.mark.parametrize(("text", "reason"), REFUSED)
def test_a_profile_that_cannot_be_is_one_line(tmp_path: Path, text: str, reason: str) -> None:
    if text in PORTS:
        text = f'name = "G"\nword_bits = 12\nport = [{PORTS[text]}]'
    file = tmp_path / "g.toml"
    file.write_text(text)
    result = run(file)
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: profile {file}: {reason}")
    assert len(result.stderr.splitlines()) == 1


def test_a_profile_that_cannot_be_read_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "latin.toml").write_bytes(b'name = "\xe9"')
    for file, reason in (("nothing.toml", "No such file"), ("latin.toml", "is no text in UTF-8")):
        result = run(tmp_path / file)
        assert (result.exit_code, reason in result.stderr) == (2, True)
    assert "give a PROFILE" in run().stderr


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "g.toml").write_text(EXAMPLE)
    result = run(tmp_path / "g.toml", "--out", tmp_path / "g.toml" / "build")
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)


def test_the_example_builds_and_a_filled_skeleton_is_kept(tmp_path: Path) -> None:
    profile, out = tmp_path / "g.toml", tmp_path / "build"
    profile.write_text(run("--example").stdout)
    assert run(profile, "--out", out).exit_code == 0
    names = {path.name for path in out.iterdir()}
    assert names == {"gripper.eds", "gripper.py", "gripper_od.h", "gripper.yaml"}
    skeleton = out / "gripper.py"
    skeleton.write_text("mine")
    assert run(profile, "--out", out).stderr == f"{skeleton} is kept; --force overwrites it\n"
    assert skeleton.read_text() == "mine"
    run(profile, "--out", out, "--force")
    assert skeleton.read_text() != "mine"


def test_objects_and_pdos_are_shown(tmp_path: Path) -> None:
    (tmp_path / "g.toml").write_text(EXAMPLE)
    lines = run(tmp_path / "g.toml").stdout.splitlines()
    assert [line.split()[0] for line in lines if line] == [
        *("object", "2100h:00", "2101h:00", "2101h:01", "2101h:02", "2101h:03"),
        *("PDO", "rpdo1", "tpdo1"),
    ]
    assert lines[-1].split() == ["tpdo1", "180h+id", "48", "forces_mn:", "3", "x", "Short"]
    (tmp_path / "e.toml").write_text(EVERYTHING)
    pdos = [line.split()[:3] for line in run(tmp_path / "e.toml").stdout.splitlines()[-17:]]
    assert [" ".join(words) for words in pdos if words[1] != "-"][8:] == [
        *("rpdo5 2A5h 3", "rpdo6 off 16", "tpdo5 off 48", "tpdo6 off 16"),
    ]
    assert [words[2] for words in pdos if words[0] == "sdo"] == ["-", "-", "80", "80", "16"]
    every = run(tmp_path / "g.toml", "--all").stdout
    assert "1017h:00  Producer heartbeat time" in every
    assert len(every.splitlines()) > 70
