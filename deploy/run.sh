#!/usr/bin/env bash
# `make run`: starts groomd on the bundled sample and leaves it running.
#
# The sample is generated (groomctl sample), uploaded, fitted, exported and drawn, by the same
# commands that a studio would script. Ctrl-C stops the daemon; what it keeps stays in $BUILD/run.
#   GROOM_LISTEN   address (127.0.0.1:8080; a free port where that is taken)
#   GROOM_PLACE    folder of its data ($BUILD/run)
#   GROOM_RUN_ONCE 1: stop when the sample is done, for tests
set -euo pipefail
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build}
place=${GROOM_PLACE:-$BUILD/run}
listen=${GROOM_LISTEN:-127.0.0.1:8080}
mkdir -p "$place"

daemon=
stop() {
    [ -n "$daemon" ] || return 0
    kill "$daemon" 2>/dev/null || true
    wait "$daemon" 2>/dev/null || true
    daemon=
}
trap stop EXIT
trap 'exit 130' INT TERM

start_daemon() { # address
    : >"$place/groomd.out"
    "$BUILD/groomd" --data "$place/data" --listen "$1" >"$place/groomd.out" 2>"$place/groomd.log" &
    daemon=$!
    for _ in $(seq 100); do
        url=$(sed -n 's/^listening on //p' "$place/groomd.out")
        [ -z "$url" ] || return 0
        kill -0 "$daemon" 2>/dev/null || return 1
        sleep 0.1
    done
    return 1
}

if ! start_daemon "$listen"; then
    daemon=
    if [ -n "${GROOM_LISTEN:-}" ] || ! grep -qi 'in use' "$place/groomd.log"; then
        echo "groomd did not start:" >&2
        tail -5 "$place/groomd.log" >&2
        exit 1
    fi
    echo "$listen is taken; using a free port"
    start_daemon 127.0.0.1:0 || { tail -5 "$place/groomd.log" >&2; exit 1; }
fi
export GROOM_SERVER=$url

echo "groomd runs at $url (log: $place/groomd.log)"
sample=$place/sample
if [ ! -e "$sample/strands.hair" ]; then
    echo "making the sample: 10 000 wavy strands on a head"
    "$BUILD/groomctl" sample --style wavy --strands 10000 --seed 1 -o "$sample"
fi
"$BUILD/groomctl" fit "$sample/strands.hair" --head-file "$sample/head.obj" --guides 300 \
    -o "$place/groom.usda" --groom-id-file "$place/groom.id"
groom=$(cat "$place/groom.id")
"$BUILD/groomctl" export "$groom" --format hair -o "$place/groom.hair"
"$BUILD/groomctl" preview "$groom" --view front --size 1024 -o "$place/preview.png"

cat <<EOF

The sample is a groom now: $groom
  dense strands   $place/groom.hair, $place/groom.usda
  preview         $place/preview.png
  look at it      $url/
  turn a knob     GROOM_SERVER=$url $BUILD/groomctl set $groom /operators/2/radius=0.01

Ctrl-C stops the daemon.
EOF
[ "${GROOM_RUN_ONCE:-0}" = 1 ] && exit 0
wait "$daemon"
