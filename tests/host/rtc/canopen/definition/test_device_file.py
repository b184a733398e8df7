from __future__ import annotations

from itertools import groupby
from pathlib import Path
from xml.sax.saxutils import quoteattr

from tests.host.rtc.canopen.bench import EDS, Bench
from tickrig.host.canopen.eds import open_eds
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.definition import read_device_file
from tickrig.wire.canopen.eds.eds_file import EdsFile

PALETTE = EDS / "f-palette.eds"
KEYS = {"DataType": "dataType", "AccessType": "accessType", "DefaultValue": "defaultValue"}
HEAD = '<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1"><CANopenObjectList>'
END = "</CANopenObjectList></ISO15745ProfileContainer>"


def xdd_of(file: EdsFile) -> str:
    """Write the objects of an EDS as CiA 311 has them."""
    parts = [HEAD]
    for index, sections in groupby(file.objects(), lambda each: each[1]):
        (head, *subs) = sections
        parts.append(f'<CANopenObject index="{index:04X}" {_attributes(file, head[0])}>')
        for section, _, sub in subs:
            parts.append(f'<CANopenSubObject subIndex="{sub:02X}" {_attributes(file, section)}/>')
        parts.append("</CANopenObject>")
    return "\n".join((*parts, END))


def _attributes(file: EdsFile, section: str) -> str:
    said = {"name": file.value(section, "ParameterName")}
    said["objectType"] = str(int(file.value(section, "ObjectType") or "7", 0))
    said["PDOmapping"] = "optional" if file.value(section, "PDOMapping") == "1" else "no"
    said |= {name: file.value(section, key) for key, name in KEYS.items() if file.has(section, key)}
    return " ".join(f"{name}={quoteattr(text)}" for name, text in said.items())


def test_an_xdd_says_what_the_eds_of_a_device_says(tmp_path: Path) -> None:
    path = tmp_path / "palette.xdd"
    path.write_text(xdd_of(open_eds(PALETTE)), "utf-8")
    assert read_device_file(path) == read_device_file(PALETTE)


def test_a_node_that_an_xdd_describes_boots_and_gives_its_ports(tmp_path: Path) -> None:
    (tmp_path / "palette.xdd").write_text(xdd_of(open_eds(PALETTE)), "utf-8")
    text = "nodes: [{id: 16, name: Palette0, eds: palette.xdd, role: device}]\n"
    bench = Bench(text, {16: "f-palette"}, tmp_path)
    bench.boot()
    bench.activate(16)
    assert bench.state(16) is LifeCycleState.ACTIVE
    of_eds = Bench(text.replace("palette.xdd", "f-palette.eds"), {16: "f-palette"})
    of_eds.boot()
    proxy, same = bench.proxy(16), of_eds.proxy(16)
    assert proxy is not None
    assert same is not None
    assert {*proxy.ports} == {*same.ports} != set()
