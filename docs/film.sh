#!/usr/bin/env bash
# Makes the moving picture of the README again, assets/readme/film.gif: opens docs/film.ron on a virtual
# display, takes a film with F10, drags an ear of the bunny and lets it go, and pulls at the banner. Needs Xvfb
# and xdotool; takes a minute. The hand follows the simulated time, so the film does not depend on the speed
# of the machine.
#
#   cargo build --release && docs/film.sh [PROGRAM]
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-${CARGO_TARGET_DIR:-target}/release/pliant}")
folder=$(mktemp -d)
journal=$folder/journal.json
export DISPLAY=:93 HOME=$folder
unset XDG_CONFIG_HOME XDG_DATA_HOME XDG_PICTURES_DIR

Xvfb "$DISPLAY" -screen 0 900x470x24 >"$folder/display.log" 2>&1 &
display=$!
trap 'kill "${window:-}" "$display" 2>/dev/null || true; rm -rf "$folder"' EXIT
sleep 1
scene=$PWD/docs/film.ron
(cd "$folder" && exec "$program" "$scene" --size 900x470 --no-settings --journal "$journal") >"$folder/window.log" 2>&1 &
window=$!

# Waits for an event of the journal.
await() {
    for _ in $(seq 400); do
        grep -q "$1" "$journal" 2>/dev/null && return
        sleep 0.1
    done
    echo "$1: did not come" >&2
    cat "$folder/window.log" >&2
    exit 1
}
# Waits for a simulated time after the start of the film [s].
until_time() {
    for _ in $(seq 3000); do
        [ "$(awk -v now="$(time_now)" -v then="$1" -v start="$start" 'BEGIN { print (now - start >= then) }')" = 1 ] && return
        sleep 0.02
    done
}
time_now() {
    grep '"tick"' "$journal" | tail -1 | sed -n 's/.*"time":\([0-9.e-]*\).*/\1/p'
}
# Moves the pointer evenly from one time to another: FROM TO X Y X Y.
glide() {
    local steps=20 i
    for i in $(seq $steps); do
        until_time "$(awk -v a="$1" -v b="$2" -v i="$i" -v n=$steps 'BEGIN { print a + (b - a) * i / n }')"
        xdotool mousemove $(($3 + ($5 - $3) * i / steps)) $(($4 + ($6 - $4) * i / steps))
    done
}

# The hand, in pixels of a window of this size.
await '"ready"'
xdotool windowfocus "$(xdotool search --onlyvisible --name Pliant | head -1)"
xdotool mousemove 170 222 sleep 0.5 key F10 sleep 0.5
await '"tick"'
start=$(time_now)
until_time 0.4
xdotool mousedown 1
glide 0.5 1.2 170 222 182 175
until_time 1.3
xdotool mouseup 1
# The cloth is chosen by a click; U lets its corners go.
until_time 2.4
xdotool mousemove 170 146 sleep 0.3 mousedown 1 sleep 0.2 mouseup 1 sleep 0.2 key u
until_time 4.0
xdotool mousemove 400 238 sleep 0.3 mousedown 1
glide 4.1 5.4 400 238 372 425
until_time 5.7
xdotool mouseup 1
until_time 6.8
xdotool key F10
await '"Saved '
mv "$folder"/Pliant/*.gif assets/readme/film.gif
ls -l assets/readme/film.gif
