"""Refuse to build what has no modules, keep the links in a source distribution, compile a wheel.

With TICKRIG_COMPILE=1 in the environment a wheel has extension modules, with TICKRIG_COMPILE=kernel
the kernel of the CAN bus alone (docs/howto/compiled.md).
All else about the build stands in pyproject.toml.
"""

import os
import re
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.sdist import sdist

FOLDERS = ("device", "emulators", "host", "wire")

PACKAGE = Path("src", "tickrig")  # where a build runs; tracebacks name these paths
if missing := [name for name in FOLDERS if not (PACKAGE / name / "__init__.py").is_file()]:
    links = " ".join(f"../../{name}" for name in FOLDERS)
    raise SystemExit(
        f"src/tickrig/{missing[0]} is no link to {missing[0]}/: this checkout has no symbolic"
        f" links, nothing of tickrig would be installed. Make them:\n  ln -sf {links} src/tickrig/"
    )


class LinkingSdist(sdist):
    """A source distribution with the tree as it is: links as links, not each module twice."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Copy the files, and make the links that setuptools has followed."""
        links = {Path("src", "tickrig", name): Path("..", "..", name) for name in FOLDERS}
        real = [name for name in files if links.keys().isdisjoint(Path(name).parents)]
        super().make_release_tree(base_dir, real)
        for link, target in links.items():
            Path(base_dir, link).symlink_to(target, target_is_directory=True)


class ParallelBuildExt(build_ext):
    """Compiles with every core: the modules are one library, and setuptools takes file by file."""

    def build_extensions(self) -> None:
        """Build all of them."""
        one_by_one, cores = self.compiler.compile, os.cpu_count() or 1

        def compile_all(sources: list[str], **options: Any) -> list[str]:
            with ThreadPoolExecutor(cores) as pool:
                made = pool.map(lambda source: one_by_one([source], **options), sources)
                return [name for names in made for name in names]

        self.compiler.compile, self.parallel = compile_all, cores
        super().build_extensions()


TAKEN = "_init(PyObject *self, PyObject *args, PyObject *kwds)\n"
"""What calls the `__init__` of a class begins so in what mypyc 2.4 writes."""

INIT = re.compile(
    rf"(\w+){re.escape(TAKEN)}\{{\n    return (?:0|\w+\(self, args, kwds\) != NULL \? 0 : -1);\n\}}"
)


STATE = "(PyCFunction)CPyPickle_SetState,"
"""What gives a copy its state in what mypyc 2.4 writes; it assigns, which frozen values refuse."""

HEADER = '#include "__native_internal_tickrig.h"\n'

SET_STATE = """
static PyObject *set_state(PyObject *copy, PyObject *state)
{
    PyObject *name, *value;
    Py_ssize_t place = 0;
    if (!PyDict_Check(state))
        return PyErr_Format(PyExc_TypeError, "%.80R is no state of this build", state);
    while (PyDict_Next(state, &place, &name, &value))
        if (PyObject_GenericSetAttr(copy, name, value) != 0)
            return NULL;
    Py_RETURN_NONE;
}
"""


def mend(sources: list[Path]) -> None:
    """Let what mypyc 2.4 writes call each `__init__`, and copy what is frozen.

    Raises:
        SystemExit: it writes something else.
    """
    texts = {source: source.read_text() for source in sources}
    for change in (calling_init, setting_state):
        mended = {source: change(text) for source, text in texts.items()}
        if mended == texts:
            raise SystemExit(f"this mypyc writes nothing that {change.__name__} in setup.py mends")
        texts = mended
    for source, text in texts.items():
        source.write_text(text)


def calling_init(text: str) -> str:
    """Return a source in which each `__init__` is called, also of classes with `serializable`."""

    def called(found: re.Match[str]) -> str:
        init = f"CPyPy_{found[1]}_____init__(self, args, kwds)"
        if init in text:  # here or in its `__new__`
            return found[0]
        return found[0].replace("return 0;", f"return {init} == NULL ? -1 : 0;")

    whole, known = INIT.subn(called, text)
    if known != text.count(TAKEN):
        raise SystemExit("this mypyc calls an __init__ in a way that setup.py does not know")
    return whole


def setting_state(text: str) -> str:
    """Return a source in which a copy gets its state though it is frozen."""
    if STATE not in text:
        return text
    return text.replace(STATE, "(PyCFunction)set_state,").replace(HEADER, HEADER + SET_STATE, 1)


def compiled_modules() -> list[str]:
    """Return the paths of the modules that are compiled, as pyproject.toml lists them."""
    table = tomllib.loads(Path("pyproject.toml").read_text())["tool"]["tickrig"]["compiled"]
    found = {path for room in table["rooms"] for path in PACKAGE.glob(room)}
    left_out = {path for names in table["left-out"] for path in PACKAGE.glob(names)}
    return sorted(str(path) for path in found - left_out if path.stem != "__init__")


KERNEL = Extension("tickrig.emulators.rig._kernel", [str(PACKAGE / "emulators/rig/_kernel.c")])
"""The short ways of a CAN bus, in C."""


def extensions() -> list[Extension]:
    """Return the extension modules of a compiled wheel; of anything else, none but the kernel."""
    if COMPILE == "kernel":
        return [KERNEL]
    if COMPILE != "1" or "bdist_wheel" not in sys.argv:
        return []
    from mypyc.build import mypycify  # noqa: PLC0415 - only where something is compiled

    made = mypycify(
        ["--follow-imports=silent", *compiled_modules()],  # what others import may be missing here
        group_name="tickrig",  # of the library that mypyc puts beside the package
        multi_file=True,  # so that all cores compile
        opt_level=os.environ.get("MYPYC_OPT_LEVEL", "2"),
        debug_level="0",
    )
    mend([*Path("build").glob("__native_*.c")])
    for extension in made:  # a product is rounded before it is added, whatever the processor can
        extension.extra_compile_args += ["-ffp-contract=off", "-fvisibility=hidden"]
    return [*made, KERNEL]


NEEDED = ["mypy[mypyc]>=2.4,<2.5", "crcmod-plus>=2.2"]
"""What compiles, and what compiled modules import of others."""

COMPILE = os.environ.get("TICKRIG_COMPILE", "")
if COMPILE not in {"", "0", "1", "kernel"}:
    raise SystemExit(f"TICKRIG_COMPILE is {COMPILE!r}; write 1, kernel or 0")
setup(
    cmdclass={"sdist": LinkingSdist, "build_ext": ParallelBuildExt},
    setup_requires=NEEDED if COMPILE == "1" else [],
    ext_modules=extensions(),
)
