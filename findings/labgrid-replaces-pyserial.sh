#!/usr/bin/env bash
# labgrid installs its own fork of pyserial over pyserial: two installed packages own the same module `serial`.
#
# Seen with labgrid 26.0.1, pyserial 3.5 and pyserial-labgrid 3.5.0.2. pyserial is installed first, then labgrid. `pip list`
# then shows both forks and `pip check` finds nothing, but `serial` is that of labgrid. After `pip uninstall pyserial-labgrid`,
# pip still lists pyserial 3.5, and `import serial` fails. Expected: a conflict that pip reports, or a module of another name.
# Why it matters: a host under test that is pinned to pyserial 3.5 is tested with another version, and an environment that
# labgrid has left cannot open a serial port.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
pip() { "$dir/venv/bin/pip" --disable-pip-version-check "$@" 2>/dev/null; }
version() { "$dir/venv/bin/python" -c "import serial; print(serial.__version__)" 2>/dev/null || echo "no module"; }
listed() { pip list --format freeze | grep '^pyserial' | tr '\n' ' '; }
pip install --quiet pyserial==3.5 || exit 77
before=$(version)
pip install --quiet labgrid==26.0.1 pyserial-labgrid==3.5.0.2 || exit 77
after="$(version), listed: $(listed)"
checked=$(pip check)
pip uninstall --quiet --yes pyserial-labgrid
left="$(version), listed: $(listed)"
echo "pyserial 3.5 installed: serial is $before"
echo "labgrid 26.0.1 installed: serial is $after"
echo "pip check: $checked"
echo "pyserial-labgrid uninstalled: serial is $left"
[ "$before" = 3.5 ] && [ "$after" = "3.5.0.2, listed: pyserial==3.5 pyserial-labgrid==3.5.0.2 " ] &&
    [ "$checked" = "No broken requirements found." ] && [ "$left" = "no module, listed: pyserial==3.5 " ] ||
    { echo "changed: one module, two packages, and none after an uninstall" >&2; exit 1; }
