"""Whether this installation is compiled (docs/howto/compiled.md), and markers for mypyc."""

from importlib import import_module

TYPE_CHECKING = False  # as typing has it, without importing it
if TYPE_CHECKING:
    from mypy_extensions import mypyc_attr as mypyc_attr  # noqa: PLC0414 - handed on
else:

    def mypyc_attr(*names, **settings):
        """Mark a class for mypyc; in plain Python it has no effect and needs no package."""
        return lambda marked: marked


compiled: bool = not str(import_module("tickrig.wire.instant").__file__).endswith(".py")
