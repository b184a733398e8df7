"""Refuse to build what has no modules, keep the links in a source distribution, compile a wheel.

With TICKRIG_COMPILE=1 in the environment a wheel has extension modules too (docs/compiled.md).
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


INIT = re.compile(
    r"(\w+)_init\(PyObject \*self, PyObject \*args, PyObject \*kwds\)\n\{\n    return 0;\n\}"
)


def call_init(source: Path) -> None:
    """Mend what mypyc 2.4 writes: nobody calls the `__init__` of a class with `serializable`."""
    text = source.read_text()

    def mended(found: re.Match[str]) -> str:
        init = f"CPyPy_{found[1]}_____init__"
        if f"PyObject *ret = {init}(self, args, kwds)" in text:  # its `__new__` calls it
            return found[0]
        return found[0].replace("return 0;", f"return {init}(self, args, kwds) == NULL ? -1 : 0;")

    source.write_text(INIT.sub(mended, text))


def compiled_modules() -> list[str]:
    """Return the paths of the modules that are compiled, as pyproject.toml lists them."""
    table = tomllib.loads(Path("pyproject.toml").read_text())["tool"]["tickrig"]["compiled"]
    found = {path for room in table["rooms"] for path in PACKAGE.glob(room)}
    left_out = {path for names in table["left-out"] for path in PACKAGE.glob(names)}
    return sorted(str(path) for path in found - left_out if path.stem != "__init__")


def extensions() -> list[Extension]:
    """Return the extension modules of a compiled wheel; of anything else, none."""
    if "bdist_wheel" not in sys.argv:
        return []
    from mypyc.build import mypycify  # noqa: PLC0415 - only where something is compiled

    made = mypycify(
        compiled_modules(),
        group_name="tickrig",  # of the library that mypyc puts beside the package
        multi_file=True,  # so that all cores compile
        opt_level=os.environ.get("MYPYC_OPT_LEVEL", "2"),
        debug_level="0",
    )
    for source in Path("build").glob("__native_*.c"):
        call_init(source)
    for extension in made:  # a product is rounded before it is added, whatever the processor can
        extension.extra_compile_args += ["-ffp-contract=off", "-fvisibility=hidden"]
    return made


COMPILE = os.environ.get("TICKRIG_COMPILE") == "1"
setup(
    cmdclass={"sdist": LinkingSdist, "build_ext": ParallelBuildExt},
    setup_requires=["mypy[mypyc]>=2.4,<2.5"] if COMPILE else [],
    ext_modules=extensions() if COMPILE else [],
)
