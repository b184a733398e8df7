"""Stubs of Tickrig's IDL, which omniidl compiles at their first use, and which are cached."""

from __future__ import annotations

import atexit
import hashlib
import importlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any, Final

from tickrig.host.rtc.states import RtcRefused

_PACKAGE: Final = "tickrig_openrtm"
"""Package name of the stubs, because other packages may have some of the same IDL modules."""

IDL: Final = Path(__file__).parent / "idl"
DATA_TYPES: Final = "DataTypes.idl"
"""IDL module for peers. In this process, values become bytes without an ORB."""

_NEEDS_OMNIORB: Final = "OpenRTM needs omniORB: pip install 'tickrig[openrtm]'"

_COMPILE: Final = "import sys; from omniidl.main import main; sys.exit(main())"
_TIMEOUT_S: Final = 60.0
_MODULES: Final = ("SDOPackage", "RTC", "OpenRTM", "RTM", "_GlobalIDL")


class Stubs:
    """The Python modules that omniORB generates from Tickrig's IDL files.

    The names in these modules are known only at run time, so their type is `Any`.

    Args:
        modules: modules by name, including the modules that contain skeleton classes, such as
            `RTC__POA`.

    Attributes:
        sdo: IDL module `SDOPackage`.
        rtc: IDL module `RTC`.
        openrtm: IDL module `OpenRTM`, with the component and data ports.
        rtm: IDL module `RTM`, with the manager.
        services: Python module with the interface `RefHard` of the RH3 base (Reference Hardware 3).
            The IDL defines this interface outside of all IDL modules.
    """

    def __init__(self, modules: dict[str, Any]) -> None:
        self._modules = modules
        self.sdo, self.rtc, self.openrtm, self.rtm, self.services = (
            modules[name] for name in _MODULES
        )

    def skeleton(self, interface: str) -> type:
        """Return the skeleton class of a CORBA interface, from which `Orb.serve` makes an object.

        Args:
            interface: name of the interface with its module, such as `RTC.PortService`. `RefHard`
                is in no module.
        """
        module, _, name = interface.rpartition(".")
        found: type = getattr(self._modules[f"{module or '_GlobalIDL'}__POA"], name)
        return found


@cache
def stubs() -> Stubs:
    """Return the Python modules that omniORB generates from Tickrig's IDL files.

    At the first use on a machine, the IDL files are compiled, which takes 0.5 s.

    Raises:
        RtcRefused: omniORB is not installed, or the stubs cannot be made.
    """
    try:
        import omniORB  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise RtcRefused(_NEEDS_OMNIORB) from error
    files = [path for path in sorted(IDL.glob("*.idl")) if path.name != DATA_TYPES]
    cached = _cache_folder() / f"openrtm-{_key(files, omniORB.coreVersion())}"
    try:
        if cached.is_dir():
            return _imported(cached)
    except Exception:  # incomplete files of an earlier run, for example
        shutil.rmtree(cached, ignore_errors=True)
    return _imported(_compiled(files, cached))


def compile_idl(files: Iterable[Path], folder: Path, package: str = _PACKAGE) -> None:
    """Compile IDL files to Python modules in a folder, by omniidl.

    Args:
        files: IDL files. The files that they include are in the folder of Tickrig's IDL.
        folder: folder for the package.
        package: name of the package that contains the modules.

    Raises:
        RtcRefused: omniidl is not installed, or reports an error.
        OSError: the folder cannot be written.
    """
    options = ["-bpython", f"-C{folder}", f"-Wbpackage={package}", f"-I{IDL}", *_preprocessor()]
    command = [sys.executable, "-c", _COMPILE, *options, *map(str, files)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise RtcRefused(f"omniidl did not end within {_TIMEOUT_S:g} s") from error
    if done.returncode:
        raise RtcRefused(f"omniidl: {' '.join((done.stderr or done.stdout).split())}")


def _preprocessor() -> list[str]:
    """Return the path of omniidl's preprocessor. The wheel has it in a folder of its own."""
    found = importlib.util.find_spec("jeteve_omniorb")
    for folder in (found and found.submodule_search_locations) or ():
        return [f"-Y{Path(folder) / 'bin' / 'omnicpp'}"]
    return []


def _cache_folder() -> Path:
    """Return the folder for this user's stubs. If there is no such place, it is below a file."""
    named = os.environ.get("XDG_CACHE_HOME", ""), os.path.expanduser("~/.cache"), os.devnull
    return next(Path(folder) for folder in named if Path(folder).is_absolute()) / "tickrig"


def _key(files: list[Path], version: str) -> str:
    """Return a hash of 16 digits over everything that the stubs depend on."""
    digest = hashlib.sha256(f"{version} {sys.version_info[:2]} {_PACKAGE}".encode())
    for path in files:
        digest.update(f"{path.name}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def _compiled(files: list[Path], cached: Path) -> Path:
    """Return the folder with new stubs, either the cached folder, or another if it is not writable.

    The stubs are written into a temporary folder, which is then renamed. Therefore two processes
    can do this at the same time. Both processes use the folder of the faster one.
    """
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix="making-", dir=cached.parent))
    except OSError:
        return _temporary(files)
    try:
        compile_idl(files, made)
        made.rename(cached)
    except OSError:
        return cached if cached.is_dir() else _temporary(files)
    finally:
        shutil.rmtree(made, ignore_errors=True)
    return cached


def _temporary(files: list[Path]) -> Path:
    """Compile the stubs into a folder that ends with this process."""
    try:
        made = Path(tempfile.mkdtemp(prefix="tickrig-openrtm-"))
        atexit.register(shutil.rmtree, made, ignore_errors=True)
        compile_idl(files, made)
    except OSError as error:
        raise RtcRefused(f"the stubs of OpenRTM cannot be written: {error}") from error
    return made


def _imported(folder: Path) -> Stubs:
    """Import the stubs from a folder without adding it to the path of modules."""
    for name in [name for name in sys.modules if name.partition(".")[0] == _PACKAGE]:
        del sys.modules[name]
    home = folder / _PACKAGE
    spec = importlib.util.spec_from_file_location(
        _PACKAGE, home / "__init__.py", submodule_search_locations=[str(home)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"no package in {folder}")
    package = importlib.util.module_from_spec(spec)
    sys.modules[_PACKAGE] = package
    spec.loader.exec_module(package)
    names = [name + end for name in _MODULES for end in ("", "__POA")]
    return Stubs({name: importlib.import_module(f"{_PACKAGE}.{name}") for name in names})
