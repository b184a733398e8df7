#!/usr/bin/env bash
# omniNames -start is for the first time in a folder, and `kill` of the one that comes as a wheel leaves the server running.
#
# Seen with jeteve-omniorb 4.3.3.post7. Its command `omniNames` is a program in Python that runs the server as a child and waits for
# it: SIGTERM ends the parent alone. The next start with -start in the same folder ends with status 1, for the file of names exists.
# Why it matters: tests of OpenRTM components start and end a name server each; one of each test stays, with its port.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check jeteve-omniorb==4.3.3.post7 || exit 77
port=$("$dir/venv/bin/python" -c 'import socket; s = socket.create_server(("127.0.0.1", 0)); print(s.getsockname()[1])')
names=("$dir/venv/bin/omniNames" -start "$port" -ORBendPoint "giop:tcp:127.0.0.1:$port" -datadir "$dir")
listens() { (: <"/dev/tcp/127.0.0.1/$port") 2>/dev/null; }
"${names[@]}" >/dev/null 2>&1 &
for _ in {1..100}; do listens && break; sleep 0.1; done
server=$(pgrep -P $!)
kill $!
wait $! || true
listens && left="runs" || left="has ended"
kill "$server"
for _ in {1..100}; do listens || break; sleep 0.1; done
"${names[@]}" >/dev/null 2>&1 && again=0 || again=$?
echo "jeteve-omniorb 4.3.3.post7: after kill the server $left; the second start ends with status $again"
[ "$left $again" = "runs 1" ] || { echo "changed: it ran, and the status was 1" >&2; exit 1; }
