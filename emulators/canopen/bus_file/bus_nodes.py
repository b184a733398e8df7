"""The slaves of a bus.yml, made from their EDS files as the master of the file expects them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path
from typing import Any, Final, NamedTuple

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds402 import Ds402, indices
from tickrig.device.canopen.ds402.modes.modes import MODES
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen import eds
from tickrig.emulators.canopen.bus_file import joint_drive, node_keys
from tickrig.emulators.canopen.bus_file.urdf import PRISMATIC, Urdf, UrdfJoint, read_urdf
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.node import Node, NodeSide
from tickrig.host.canopen.bus_file.bus_file import BusFile, read_bus_file
from tickrig.host.canopen.bus_file.bus_values import BusSlave
from tickrig.host.canopen.bus_file.notes import BusFileNotes
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.host.text.document import FileMistake, FilePlace
from tickrig.wire.canopen.eds.eds_file import EdsError

# Parts of each node of a bus.yml: its EDS, the settings of its master, and a joint.

_TRAVEL_M: Final = 0.01
"""Default travel of a carriage per turn of the shaft."""
_BEYOND_RAD: Final = 0.01
_BEYOND_M: Final = 0.001
"""Distance of the switches beyond the limits of a URDF. A joint at its limit presses no switch."""
_SECOND_AXIS: Final = 0x800
"""Offset of the objects of each further axis (CiA 402-1)."""
_SAME_UNITS: Final = 0.001
"""Relative tolerance between the units of an EDS and those of ROS."""
_IDENTITY: Final = 0x1018
_SOFTWARE: Final = (0x1F56, 1)


@dataclass(frozen=True, slots=True)
class _BusNode:
    """A slave.

    Attributes:
        name: name of the section of the slave.
        node_id: node-ID 1..127.
        line: line number of the section.
        description: description of the device, with its initial inputs.
        about: text about what the slave moves, or empty if it moves nothing.
    """

    name: str
    node_id: int
    line: int
    description: eds.DeviceDescription
    about: str = ""


def _modes_listed(dictionary: Dictionary) -> frozenset[int]:
    """Return the modes that 6502h of a dictionary lists, or all modes if it lists no mode."""
    entry = dictionary.find(indices.SUPPORTED_MODES)
    listed = entry.number if entry else 0
    known = (number for number in MODES if number > 0)
    return frozenset(n for n in known if not listed or listed >> n - 1 & 1)


class _NodeMaker:
    """Makes the slaves of a bus.yml.

    Args:
        bus: content of the bus.yml.
        robot: joints of the robot, or None if there is no description of them.
        cache: cache of EDS files.
        mistakes: list that collects errors.
        profile: name of a profile in `choices.PROFILES`, for nodes without a profile.

    Attributes:
        remarks: list of warnings.
        added: objects added to nodes whose EDS lacks them.
    """

    def __init__(
        self,
        bus: BusFile,
        robot: Urdf | None,
        cache: eds.EdsCache,
        mistakes: list[FileMistake],
        profile: str,
    ) -> None:
        self._bus, self._cache, self._mistakes = bus, cache, mistakes
        self._profile = profile
        self.remarks: list[FileMistake] = []
        self.added: list[FileMistake] = []
        self._joints = dict(self._joints_of(robot)) if robot else {}
        self._robot = (Path(robot.name),) if robot else ()

    def nodes(self) -> Iterator[_BusNode]:
        """Yield all valid slaves."""
        for slave in self._bus.slaves.values():
            keys = node_keys.read_keys(
                (slave.extra, self._bus.options.extra), slave.name, self._mistakes
            )
            try:
                sheet = self._cache.read(slave.sheet, None)
            except (EdsError, OSError):
                continue  # the reader of the file has noted it
            master = self._bus.master
            rate = 1_000 * master.baudrate if master else None
            yield self._node(
                slave, keys, replace(sheet, node_id=slave.node_id, bit_rate=rate or None)
            )

    def _joints_of(self, robot: Urdf) -> Iterator[tuple[str, UrdfJoint]]:
        """Yield the joints of the robot with the name of their node."""
        by_id = {slave.node_id: name for name, slave in self._bus.slaves.items()}
        for joint in robot.joints:
            name = joint.device_name or by_id.get(joint.node_id or 0, "")
            if name in self._bus.slaves:
                yield name, joint
            else:
                what = f"node {name!r}" if name else f"node-ID {joint.node_id}"
                text = f"joint {joint.name!r}: no {what} in {self._bus.path.name}"
                self.remarks.append(FileMistake(joint.place, text))

    def _node(
        self, slave: BusSlave, keys: node_keys.NodeKeys, sheet: eds.DeviceDescription
    ) -> _BusNode:
        sheet = replace(sheet, template=self._identified(slave, sheet.template))
        profile, about = keys.profile or self._profile, ""
        start = dict(keys.start)
        if eds.application_of(sheet.template, profile) is Ds402:
            self._check_axes(slave, sheet.template)
            joint = self._joint(slave, keys)
            self._check_units(slave, sheet.template)
            sheet = eds.in_profile(sheet, profile, joint.defaults())
            template = self._completed(slave, keys, sheet.template, joint)
            sheet = replace(sheet, template=template, application=joint.application())
            about, start = joint.about(template), {**joint.start, **start}
        else:
            sheet = eds.in_profile(sheet, profile)
            self._check_no_joint(slave, keys)
        if keys.configured:
            written = {(each.index, each.sub_index): each.data for each in slave.writes}
            sheet = replace(sheet, template=joint_drive.with_values(sheet.template, written))
        files = (slave.sheet, *self._robot)
        description = replace(sheet, start=start, files=files)
        self._check_start(slave, keys, description)
        return _BusNode(slave.name, slave.node_id, slave.place.line, description, about)

    def _identified(self, slave: BusSlave, dictionary: Dictionary) -> Dictionary:
        """Return the dictionary with the identity in the file; a 0 changes nothing."""
        identity = slave.identity
        wanted = {
            (_IDENTITY, 1): identity.vendor_id,
            (_IDENTITY, 2): identity.product_code,
            (_IDENTITY, 3): identity.revision_number,
            (_IDENTITY, 4): identity.serial_number,
            _SOFTWARE: slave.software_version,
        }
        return joint_drive.with_values(
            dictionary, {at: value for at, value in wanted.items() if value}
        )

    def _check_axes(self, slave: BusSlave, dictionary: Dictionary) -> None:
        """Report a drive of several axes, because the profile has one axis; warn of unused axes."""
        second = indices.CONTROLWORD + _SECOND_AXIS
        if slave.num_channels > 1:
            text = "a drive of several axes (CiA 402-1) is not emulated"
            text = f"{slave.name}: {text}; profile: none for its objects"
            self._mistakes.append(FileMistake(slave.place, text))
        elif dictionary.find(second) is not None:
            text = f"{slave.name}: of its axes (CiA 402-1) the first one is emulated"
            self.remarks.append(FileMistake(slave.place, text))

    def _check_units(self, slave: BusSlave, dictionary: Dictionary) -> None:
        """Warn of speeds in other units than the driver expects; an EDS may have its own."""
        own = (indices.SI_UNIT_VELOCITY, indices.VELOCITY_DIMENSION, indices.FEED_CONSTANT)
        if any(index in dictionary.objects for index in own):
            return
        for axis in slave.channels[:1]:
            if abs(axis.scale_vel_to_dev) != abs(axis.scale_pos_to_dev):
                text = (
                    f"{slave.name}: scale_vel_to_dev is {axis.scale_vel_to_dev:g}, but the drive"
                    f" counts speeds as positions: {axis.scale_pos_to_dev:g} a second"
                )
                self.remarks.append(FileMistake(slave.place, text))

    def _check_no_joint(self, slave: BusSlave, keys: node_keys.NodeKeys) -> None:
        """Report keys of a motor in a node without a motor."""
        for name in (*node_keys.JOINT_KEYS, "modes"):
            if name in slave.extra:
                text = f"{slave.name}.tickrig.{name}: it is no CiA 402 drive, and has no motor"
                self._mistakes.append(FileMistake(keys.places[name], text))

    def _joint(self, slave: BusSlave, keys: node_keys.NodeKeys) -> joint_drive.JointDrive:
        """Return the motion of a node, from its keys, or the robot, or the driver's scale."""
        scale = slave.channels[0].scale_pos_to_dev if slave.channels else joint_drive.UNITS
        found: dict[str, Any] = {"units": abs(scale) or joint_drive.UNITS}
        if robot := self._joints.get(slave.name):
            beyond = _BEYOND_M if robot.kind == PRISMATIC else _BEYOND_RAD
            found |= {
                "lower": None if robot.lower is None else robot.lower - beyond,
                "upper": None if robot.upper is None else robot.upper + beyond,
                "max_velocity": robot.velocity,
                "max_torque": robot.effort,
                "gear_ratio": robot.reduction,
            }
            if robot.kind == PRISMATIC:
                found["travel_m"] = _TRAVEL_M
        found |= keys.joint
        lower, upper = found.get("lower"), found.get("upper")
        if lower is not None and upper is not None and lower >= upper:
            place = keys.places.get("lower", keys.places.get("upper", slave.place))
            text = f"{slave.name}.tickrig.lower: {lower:g} is not below upper, which is {upper:g}"
            self._mistakes.append(FileMistake(place, text))
        return joint_drive.JointDrive(**found)

    def _completed(
        self,
        slave: BusSlave,
        keys: node_keys.NodeKeys,
        dictionary: Dictionary,
        joint: joint_drive.JointDrive,
    ) -> Dictionary:
        """Return the objects of a drive, and warn of objects that are missing in its EDS."""
        listed = _modes_listed(dictionary)
        modes = keys.modes or listed | self._asked_for(slave, listed)
        wanted = modes if keys.modes else modes - listed
        if added := joint_drive.missing(dictionary, wanted):
            names = ", ".join(f"{index:04X}h" for index in added)
            text = f"its EDS lacks {names}, which its modes need: they are added"
            self.added.append(FileMistake(slave.place, f"{slave.name}: {text}"))
        template = joint_drive.complete(dictionary, modes, added, joint.defaults())
        return self._in_units(slave, keys, template, joint)

    def _in_units(
        self,
        slave: BusSlave,
        keys: node_keys.NodeKeys,
        dictionary: Dictionary,
        joint: joint_drive.JointDrive,
    ) -> Dictionary:
        """Return the objects of a drive with the units of its keys; warn of different units."""
        written = {
            (each.index, each.sub_index): each.data
            for each in slave.writes
            if each.index in joint_drive.UNITS_OF_POSITION
        }
        given, place = joint.units_of(dictionary), slave.place
        said, result = f"scale_pos_to_dev {joint.units:g}", dictionary
        if "units" in keys.joint:
            result = joint_drive.with_factors(dictionary, joint.defaults())
            said, place = f"tickrig.units {joint.units:g}", keys.places["units"]
        found = joint.units_of(joint_drive.with_values(result, written))
        differs = (
            f"{slave.name}: {said}, but {slave.sheet.name} says {given:g} units a {joint.unit}"
        )
        fix = "its 608Fh, 6091h, 6092h, 60A8h"
        if not isclose(found, joint.units, rel_tol=_SAME_UNITS):
            after = f" ({found:g} after the boot-up)" if not isclose(found, given) else ""
            text = f"{differs}{after} by {fix}: its shaft turns by another angle than ROS believes"
            self.remarks.append(FileMistake(place, text))
        elif result is not dictionary and not isclose(given, joint.units, rel_tol=_SAME_UNITS):
            self.remarks.append(FileMistake(place, f"{differs}: {fix} are changed"))
        return result

    def _asked_for(self, slave: BusSlave, listed: frozenset[int]) -> frozenset[int]:
        """Return the modes that the file writes to 6060h and that the EDS does not list."""
        found = set()
        for write in slave.writes:
            if write.index != indices.MODES_OF_OPERATION:
                continue
            number = int.from_bytes(write.data, "little", signed=True)
            if number in joint_drive.NAMES.keys() - listed:
                mode = joint_drive.NAMES[number]
                text = f"mode {number} ({mode}) is not in 6502h of its EDS: it is added"
                found.add(number)
            elif number and number not in joint_drive.NAMES:
                text = f"mode {number} is not emulated: 6060h refuses it, and so fails the boot-up"
            else:
                continue
            self.remarks.append(FileMistake(write.place, f"{slave.name}: {text}"))
        return frozenset(found)

    def _check_start(
        self, slave: BusSlave, keys: node_keys.NodeKeys, description: eds.DeviceDescription
    ) -> None:
        """Report initial inputs that do not exist or do not accept their value."""
        if not keys.start:
            return
        made = make_slave(
            description.make_dictionary(), slave.node_id, None, description.application
        )
        inputs = NodeSide(Node(slave.name, made, CanWire())).inputs
        for name, value in keys.start.items():
            try:
                inputs.check(name, value)
            except ValueError as error:
                text = f"{slave.name}.tickrig.start.{name}: {error}"
                self._mistakes.append(FileMistake(keys.places.get(name, slave.place), text))


@dataclass(frozen=True, slots=True)
class BusNodes:
    """The CANopen slaves that a bus.yml describes, ready to be emulated.

    Attributes:
        nodes: slaves in the order of the file.
        remarks: warnings, one per line.
    """

    nodes: tuple[_BusNode, ...]
    remarks: tuple[str, ...] = ()


def read_bus(
    path: Path,
    urdf: Path | None = None,
    cache: eds.EdsCache | None = None,
    profile: str = AUTO,
) -> BusNodes:
    """Read a bus.yml and the files it names, and describe its slaves.

    A cached result is returned if none of the files has changed.

    Args:
        path: path of the bus.yml.
        urdf: path of the URDF file that describes the joints of the robot. With None, the path is
            taken from the key `urdf` in the mapping `tickrig:` of the section `options:` in the
            bus.yml.
        cache: cache of EDS files and slaves.
        profile: name of a profile in `choices.PROFILES`, for nodes without a profile.

    Raises:
        OSError: the bus.yml or the URDF cannot be read.
        BusMistakesError: the files have errors; the exception has all of them.
    """
    cache = cache or eds.EdsCache()
    versions, found = cache.others.get((path, urdf, profile), ({}, None))
    if isinstance(found, BusNodes) and all(_is_same(*each) for each in versions.items()):
        return found
    bus = read_bus_file(path)
    found = _nodes_of(bus, urdf, cache, profile)
    files = {path, *(file for node in found.nodes for file in node.description.files)}
    versions = {file: eds.version_of(file) for file in sorted(files)}
    cache.others[path, urdf, profile] = versions, found
    return found


def check_nodes(bus: BusFile) -> tuple[RuleFinding, ...]:
    """Check a bus.yml for errors that prevent its slaves from being emulated.

    `BusFile` has already checked the form of the file. This function finds further errors, such as
    errors under the key `tickrig:` or in the description of the robot.

    Args:
        bus: content of the file. Without slaves there is nothing to check.

    Returns:
        The errors and warnings.
    """
    if not bus.slaves:
        return ()
    told = {FilePlace(one.file, one.line) for one in bus.errors}
    made = _made(bus, None, eds.EdsCache(), AUTO)
    notes = BusFileNotes()
    for rule, found in (("tickrig", made.mistakes), ("joint", made.remarks)):
        for place, text, _ in sorted(found):
            if place not in told:
                notes.note(rule, place, "", text)
    return notes.all


def _is_same(file: Path, version: eds.Version) -> bool:
    try:
        return eds.version_of(file) == version
    except OSError:
        return False


class _Made(NamedTuple):
    """The result of reading a file: slaves, errors, warnings, added objects."""

    nodes: tuple[_BusNode, ...]
    mistakes: list[FileMistake]
    remarks: list[FileMistake]
    added: list[FileMistake]


def _made(bus: BusFile, urdf: Path | None, cache: eds.EdsCache, profile: str) -> _Made:
    mistakes: list[FileMistake] = []
    robot = None
    try:
        robot = _robot(bus, urdf)
    except node_keys.BusMistakesError as error:
        mistakes += error.mistakes
    maker = _NodeMaker(bus, robot, cache, mistakes, profile)
    return _Made(tuple(maker.nodes()), mistakes, maker.remarks, maker.added)


def _nodes_of(bus: BusFile, urdf: Path | None, cache: eds.EdsCache, profile: str) -> BusNodes:
    made = _made(bus, urdf, cache, profile)
    mistakes = [FileMistake(FilePlace(one.file, one.line), _said(one)) for one in bus.errors]
    mistakes += made.mistakes
    if mistakes:
        raise node_keys.BusMistakesError(mistakes)
    if not bus.slaves:
        raise node_keys.BusMistakesError(
            [FileMistake(FilePlace(str(bus.path), 1), "no node with a dcf")]
        )
    remarks = tuple(map(str, (*bus.warnings, *made.remarks, *made.added)))
    return BusNodes(made.nodes, remarks)


def _said(one: Any) -> str:
    where = f"{one.section}: " if one.section else ""
    return f"{where}{one.text}; fix: {one.rule.fix} ({one.rule.name})"


def _robot(bus: BusFile, urdf: Path | None) -> Urdf | None:
    """Return the robot that the file or the argument names, or None without a robot."""
    if urdf is not None:
        return read_urdf(urdf)
    item = bus.options.extra.get(node_keys.URDF)
    if item is None:
        return None
    if not isinstance(item.value, str) or not item.value or "\0" in item.value:
        raise node_keys.BusMistakesError(
            [FileMistake(item.place, f"options.tickrig.urdf: {item} is no file")]
        )
    file = bus.path.parent / item.value
    try:
        return read_urdf(file)
    except OSError as error:
        text = f"options.tickrig.urdf: {file}: {error.strerror}"
        raise node_keys.BusMistakesError([FileMistake(item.place, text)]) from None
