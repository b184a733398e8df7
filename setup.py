"""Refuse to build what has no modules, and keep the links in a source distribution.

All else about the build stands in pyproject.toml.
"""

from pathlib import Path

from setuptools import setup
from setuptools.command.sdist import sdist

FOLDERS = ("device", "emulators", "host", "wire")

package = Path(__file__).parent / "src" / "tickrig"
if missing := [name for name in FOLDERS if not (package / name / "__init__.py").is_file()]:
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


setup(cmdclass={"sdist": LinkingSdist})
