"""XDD and XDC files (XML, CiA 311), converted to the lines of an EDS.

Document types and their entities are refused. No external file is fetched.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final
from xml.parsers import expat

from tickrig._compiled import mypyc_attr
from tickrig.wire.canopen.eds.eds_value import EdsLine, canonical_section

_DEEPEST: Final = 64

_DATA_TYPES: Final = {
    **{"BOOL": 0x01, "SINT": 0x02, "INT": 0x03, "DINT": 0x04, "LINT": 0x15},
    **{"USINT": 0x05, "UINT": 0x06, "UDINT": 0x07, "ULINT": 0x1B},
    **{"BYTE": 0x05, "WORD": 0x06, "DWORD": 0x07, "LWORD": 0x1B},
    **{"REAL": 0x08, "LREAL": 0x11, "CHAR": 0x09, "STRING": 0x09},
    **{"WSTRING": 0x0B, "BITSTRING": 0x0A},
}
"""Data types of parameters (CiA 311, after IEC 61131-3), and data types of CiA 301."""

_ACCESS: Final = {
    **{"const": "const", "read": "ro", "write": "wo", "readWrite": "rw"},
    **{"readWriteInput": "rwr", "readWriteOutput": "rww"},
}
_MAPPED_AS: Final = {("rw", "TPDO"): "rwr", ("rw", "RPDO"): "rww"}
_FLAGS: Final = {"true": "1", "false": "0"}
_RATE: Final = re.compile(
    r"([0-9]++) *+(?:(k)|(m))? *+(?:bps|bit/s|bd|baud)?", re.ASCII | re.IGNORECASE
)

_IDENTITY: Final = {
    **{"vendorName": "VendorName", "vendorID": "VendorNumber", "productName": "ProductName"},
    **{"productID": "ProductNumber", "orderNumber": "OrderCode"},
}
_FEATURES: Final = {
    **{"granularity": "Granularity", "nrOfRxPDO": "NrOfRXPDO", "nrOfTxPDO": "NrOfTXPDO"},
    **{"bootUpSlave": "SimpleBootUpSlave", "bootUpMaster": "SimpleBootUpMaster"},
    **{"groupMessaging": "GroupMessaging", "dynamicChannels": "DynamicChannelsSupported"},
    **{"layerSettingServiceSlave": "LSS_Supported", "ngSlave": "NG_Slave"},
    **{"ngMaster": "NG_Master", "NrOfNG_MonitoredNodes": "NrOfNG_MonitoredNodes"},
}
_COMMISSIONING: Final = {
    **{"nodeID": "NodeID", "NodeID": "NodeID", "nodeName": "NodeName"},
    **{"networkName": "NetworkName", "networkNumber": "NetNumber"},
    "CANopenManager": "CANopenManager",
}
"""Attributes with an EDS keyword: `nodeID` is in CiA 311, and CANopenEditor writes `NodeID`."""
_OBJECT: Final = {
    **{"name": "ParameterName", "subNumber": "SubNumber", "defaultValue": "DefaultValue"},
    **{"actualValue": "ParameterValue", "denotation": "Denotation", "objFlags": "ObjFlags"},
    **{"lowLimit": "LowLimit", "highLimit": "HighLimit"},
}
_FILE: Final = {
    **{"fileName": "FileName", "fileVersion": "FileVersion", "fileCreator": "CreatedBy"},
    **{"fileModifiedBy": "ModifiedBy"},
}


class XddError(ValueError):
    """Error in an XDD or XDC file, because of which the XML cannot be read.

    Attributes:
        line: line number, or 0 for the file as a whole.
    """

    def __init__(self, reason: str, line: int) -> None:
        super().__init__(reason)
        self.line = line


@mypyc_attr(serializable=True)
class Element:
    """An XML element, whose names have no prefixes."""

    def __init__(self, name: str, attributes: dict[str, str], line: int) -> None:
        self.name = name
        self.attributes = attributes
        self.line = line
        self.text = ""
        self.children: list[Element] = []


def is_xml(text: str) -> bool:
    """Return whether a text is XML, by a start that no EDS can have."""
    return text.lstrip().startswith("<")


def xdd_lines(text: str) -> list[EdsLine]:
    """Convert an XDD or XDC file to the lines of an equivalent EDS.

    Raises:
        XddError: the text is not well-formed, has a document type, or has no CANopen object list.
    """
    elements = read_xml(text)
    if not any(element.name == "CANopenObjectList" for element in elements):
        root = elements[0]
        raise XddError(f"is XML of <{root.name[:40]}>, without a CANopenObjectList", root.line)
    return [*_head(elements), *_objects(elements, _Parameters(elements))]


def read_xml(text: str) -> list[Element]:
    """Return all elements of an XML text in their order, with their line numbers.

    Raises:
        XddError: the text is not well-formed, has a document type, or is nested deeper than 64.
    """
    body = text.lstrip()
    reader = _Reader(text.count("\n", 0, len(text) - len(body)))
    parser = expat.ParserCreate()
    reader.parser = parser
    parser.StartElementHandler = reader.begin
    parser.EndElementHandler = reader.end
    parser.CharacterDataHandler = reader.take
    parser.StartDoctypeDeclHandler = reader.refuse
    try:
        parser.Parse(body, True)
    except expat.ExpatError as error:
        where = error.lineno + reader.skipped
        raise XddError(f"is no XML: {expat.ErrorString(error.code)}", where) from None
    except UnicodeError:
        raise XddError("is no XML: it has a character that none has", 0) from None
    return reader.found


class _Reader:
    """Handles the events of the parser, after a number of skipped lines."""

    def __init__(self, skipped: int) -> None:
        self.skipped = skipped
        self.parser: expat.XMLParserType | None = None
        self.found: list[Element] = []
        self._open: list[Element] = []
        self._texts: list[list[str]] = []  # of what is open: pieces, which are joined at its end

    @property
    def _line(self) -> int:
        return self.skipped + self.parser.CurrentLineNumber if self.parser is not None else 0

    def begin(self, name: str, attributes: dict[str, str]) -> None:
        if len(self._open) >= _DEEPEST:
            raise XddError(f"is nested deeper than {_DEEPEST} elements", self._line)
        plain = {key.rpartition(":")[2]: value for key, value in attributes.items()}
        element = Element(name.rpartition(":")[2], plain, self._line)
        if self._open:
            self._open[-1].children.append(element)
        self._open.append(element)
        self._texts.append([])
        self.found.append(element)

    def end(self, name: str) -> None:
        self._open.pop().text = "".join(self._texts.pop())

    def take(self, data: str) -> None:
        self._texts[-1].append(data)

    def refuse(self, *words: object) -> None:
        raise XddError("has a document type, which is refused", self._line)


_Item = tuple[str, str, int]
"""A keyword, its text, and the line of its element."""


def _section(title: str, line: int, items: Iterable[_Item]) -> Iterator[EdsLine]:
    """Yield the lines of a section."""
    section = canonical_section(title)
    yield EdsLine(line, f"[{title}]", section, title or "-", content=f"[{title}]")
    for key, value, number in items:
        text = f"{key}={value}"
        yield EdsLine(number, text, section, "", key, value, text)


def _renamed(element: Element, names: Mapping[str, str]) -> Iterator[_Item]:
    """Yield the attributes of an element that have an EDS keyword."""
    for name, key in names.items():
        if name in element.attributes:
            text = element.attributes[name]
            yield key, _FLAGS.get(text, text), element.line


def _head(elements: list[Element]) -> Iterator[EdsLine]:
    found: dict[str, list[_Item]] = {}
    for element in elements:
        for title, item in _head_items(element):
            found.setdefault(title, []).append(item)
    for title, items in found.items():
        yield from _section(title, items[0][2], dict.fromkeys(items))


def _head_items(element: Element) -> Iterator[tuple[str, _Item]]:
    """Yield the keywords of an element for the file or device, each with its section."""
    match element.name:
        case "ProfileBody":
            yield from (("FileInfo", item) for item in _renamed(element, _FILE))
        case "CANopenGeneralFeatures" | "CANopenMasterFeatures":
            yield from (("DeviceInfo", item) for item in _renamed(element, _FEATURES))
        case "deviceCommissioning":
            yield from (("DeviceComissioning", item) for item in _renamed(element, _COMMISSIONING))
            if "actualBaudRate" in element.attributes:
                rate = _kbit(element.attributes["actualBaudRate"])
                yield "DeviceComissioning", ("Baudrate", rate, element.line)
        case "supportedBaudRate":
            rate = _kbit(element.attributes.get("value", ""))
            yield "DeviceInfo", (f"BaudRate_{rate}", "1", element.line)
        case "dummy":
            key, _, value = element.attributes.get("entry", "").partition("=")
            yield "DummyUsage", (key, value, element.line)
        case name if name in _IDENTITY:
            yield "DeviceInfo", (_IDENTITY[name], element.text.strip(), element.line)
        case _:
            pass


def _kbit(text: str) -> str:
    """Return a bit rate in kbit/s; return other texts unchanged.

    >>> _kbit("250 Kbps"), _kbit("1 Mbps"), _kbit("500000"), _kbit("auto-baudRate")
    ('250', '1000', '500000', 'auto-baudRate')
    """
    match = _RATE.fullmatch(text.strip())
    if match is None:
        return text
    return f"{match[1]}000" if match[3] else match[1]


def _objects(elements: list[Element], parameters: _Parameters) -> Iterator[EdsLine]:
    for element in elements:
        if element.name != "CANopenObject":
            continue
        index = element.attributes.get("index", "").removeprefix("0x")
        yield from _section(index, element.line, _entry(element, parameters))
        for child in element.children:
            if child.name == "CANopenSubObject":
                sub = child.attributes.get("subIndex", "").removeprefix("0x")
                yield from _section(f"{index}sub{sub}", child.line, _entry(child, parameters))


def _entry(element: Element, parameters: _Parameters) -> Iterator[_Item]:
    """Yield the keywords of an object or entry, those of its own attributes first."""
    parameter = parameters.of(element)
    said = {key: (text, line) for key, text, line in _renamed(element, _OBJECT)}
    kind = element.attributes.get("objectType", "7")
    said["ObjectType"] = kind, element.line
    if kind not in _COMPOSED:
        for key, text, line in (*_own(element), *parameters.items(parameter)):
            said.setdefault(key, (text, line))
        mapping = element.attributes.get("PDOmapping", "no")
        said["PDOMapping"] = str(int(mapping != "no")), element.line
        if "AccessType" in said:
            access, line = said["AccessType"]
            said["AccessType"] = _MAPPED_AS.get((access, mapping), access), line
    else:
        misplaced = (item for item in parameters.items(parameter) if item[0] == "ParameterValue")
        for key, text, line in misplaced:  # of a sub-object: CANopenEditor writes it here
            said.setdefault(key, (text, line))
    for key, (text, line) in said.items():
        yield key, text, line


_COMPOSED: Final = ("8", "9")
"""Object types of arrays and records, whose values are in sub-objects."""


def _own(element: Element) -> Iterator[_Item]:
    """Yield data type and access of an element itself."""
    if "dataType" in element.attributes:
        text = element.attributes["dataType"].removeprefix("0x")
        yield "DataType", f"0x{text}", element.line
    if "accessType" in element.attributes:
        yield "AccessType", element.attributes["accessType"], element.line


class _Parameters:
    """The parameters of the device profile, referenced by `uniqueIDRef`."""

    def __init__(self, elements: list[Element]) -> None:
        self._known = {
            element.attributes["uniqueID"]: element
            for element in elements
            if "uniqueID" in element.attributes
        }

    def of(self, element: Element) -> Element | None:
        """Return the element that an element refers to, or None if it is missing."""
        return self._known.get(element.attributes.get("uniqueIDRef", ""))

    def items(self, parameter: Element | None) -> Iterator[_Item]:
        """Yield the keywords of a parameter."""
        if parameter is None:
            return
        access = parameter.attributes.get("access", "read")
        yield "AccessType", _ACCESS.get(access, access), parameter.line
        for child in parameter.children:
            match child.name:
                case "defaultValue" | "actualValue":
                    key = "DefaultValue" if child.name == "defaultValue" else "ParameterValue"
                    yield key, child.attributes.get("value", ""), child.line
                case "allowedValues":
                    yield from _limits(child)
                case "label":
                    yield "ParameterName", " ".join(child.text.split()), child.line
                case _:
                    yield from self._data_type(child)

    def _data_type(self, child: Element) -> Iterator[_Item]:
        """Yield the data type of an element, or of the type that it refers to."""
        referred = self.of(child) if child.name == "dataTypeIDRef" else None
        for element in (child, *(referred.children if referred is not None else ())):
            if element.name in _DATA_TYPES:
                yield "DataType", f"0x{_DATA_TYPES[element.name]:04X}", child.line


def _limits(allowed: Element) -> Iterator[_Item]:
    for area in allowed.children:
        for bound in area.children if area.name == "range" else ():
            if key := {"minValue": "LowLimit", "maxValue": "HighLimit"}.get(bound.name):
                yield key, bound.attributes.get("value", ""), bound.line
