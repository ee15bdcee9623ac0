#!/usr/bin/env bash
# Opens programs in windows of a virtual display, one after the other, each until its clay has run for some frames and a picture is taken:
# bash scripts/examples.sh FOLDER PROGRAM... A line of an error in what a program says, or an end of its own, is a fault. The one called `outside` is pressed
# by the mouse too, undone and exported by keys.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=$1
shift
mkdir -p "$out"
: >"$out/log"
name=examples.sh
# shellcheck source=scripts/display.sh
. scripts/display.sh
open_display

# Where the clay stands in the picture of `outside`.
press() {
    local i
    xdotool windowfocus --sync "$(xdotool search --onlyvisible --name '.' | head -n 1)"
    xdotool mousemove 640 330
    sleep 1
    xdotool mousedown 1
    await "[1-9]\.[0-9]* N" >/dev/null
    for i in 1 2 3 4 5; do xdotool mousemove $((640 + 10 * i)) 330 && sleep 0.3; done
    import -window root -depth 8 "$out/outside_pressed.png"
    xdotool mouseup 1 mousemove 1200 60
    # A stroke is over when nothing has touched the clay for a while.
    sleep 3
    xdotool key u
    await "Undone"
    xdotool key e
    await "wrote"
}

for program in "$@"; do
    program=$(realpath "$program")
    title=$(basename "$program")
    (cd "$out" && exec "$program") >"$out/log" 2>&1 &
    app=$!
    await "runs on the" >/dev/null
    sleep 3
    import -window root -depth 8 "$out/$title.png"
    [ "$title" != outside ] || press
    kill -0 "$app" 2>/dev/null || fail "$title ended early"
    kill "$app"
    wait "$app" 2>/dev/null || true
    app=""
    ! grep -E "ERROR|panicked" "$out/log" || fail "$title says errors"
    echo "$title: $(grep -m1 -o "runs on the.*" "$out/log")"
    mv "$out/log" "$out/$title.log"
    : >"$out/log"
done
