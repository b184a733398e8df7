#!/usr/bin/env bash
# One number of a bus.yml is two numbers for its readers: PyYAML (dcfgen, cogen) and yaml-cpp (ros2_canopen).
#
# Seen with PyYAML 6.0.3 and yaml-cpp 0.7.0 of Debian 12. A leading zero is octal for PyYAML and for as<int>() of yaml-cpp, and decimal for its
# as<double>(); base 60 and underscores are numbers of YAML 1.1 that yaml-cpp does not convert; 1.5e3 is a text for PyYAML,
# whose exponents need a sign.
# Why it matters: the master is configured with one number and the driver works with another, and no reader reports it.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check PyYAML==6.0.3 || exit 77
command -v g++ >/dev/null || exit 77
(cd "$dir" && apt-get download -qq libyaml-cpp-dev=0.7.0\* libyaml-cpp0.7=0.7.0\* 2>/dev/null &&
    for package in *.deb; do dpkg -x "$package" .; done) || exit 77
printf '%s\n' 010 1:30 1_0 1.5e3 1.5e+3 >"$dir/numbers"
cat >"$dir/read.cpp" <<'CPP'
#include <iostream>
#include <yaml-cpp/yaml.h>
template <typename T> void show(const std::string &text) {
    try {
        std::cout << ' ' << YAML::Load("a: " + text)["a"].as<T>();
    } catch (const YAML::BadConversion &) {
        std::cout << "error";
    }
}
int main() {
    for (std::string text; std::getline(std::cin, text);) {
        std::cout << text << ':';
        show<int>(text);
        show<double>(text);
        std::cout << '\n';
    }
}
CPP
lib=$(dirname "$(find "$dir/usr/lib" -name 'libyaml-cpp.so.0.7')")
g++ -o "$dir/read" -I"$dir/usr/include" "$dir/read.cpp" "$lib/libyaml-cpp.so.0.7"
cpp=$(LD_LIBRARY_PATH=$lib "$dir/read" <"$dir/numbers")
python=$("$dir/venv/bin/python" -c 'import sys, yaml
for text in map(str.strip, sys.stdin):
    print(f"{text}: {yaml.safe_load(text)!r}")' <"$dir/numbers")
printf 'PyYAML 6.0.3:\n%s\nyaml-cpp 0.7.0, as<int>() and as<double>():\n%s\n' "$python" "$cpp"
[ "$python" = "010: 8
1:30: 90
1_0: 10
1.5e3: '1.5e3'
1.5e+3: 1500.0" ] || { echo 'changed: PyYAML' >&2; exit 1; }
[ "$cpp" = "010: 8 10
1:30: error error
1_0: error error
1.5e3: error 1500
1.5e+3: error 1500" ] || { echo 'changed: yaml-cpp' >&2; exit 1; }
