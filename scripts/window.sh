#!/usr/bin/env bash
# Sculpts in a window with a mouse that nobody holds: a virtual display, the example `sculpt`, real mouse and key events. Checks that a press dents the
# clay where it was made, that a drag leaves a groove and the knife cuts in two, that a slider changes what the tool feels, that undo takes back. Pictures go to out/window.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=${1:-out/window}
mkdir -p "$out"
rm -f "$out"/*.png
: >"$out/log"

name=window.sh
# shellcheck source=scripts/display.sh
. scripts/display.sh
# The package alone, as scripts/test.sh builds it: the whole workspace has other features, and all would be compiled once more.
cargo build --quiet -p bevy_clay --features "demo inspector xr" --example sculpt
sculpt=${CARGO_TARGET_DIR:-target}/debug/examples/sculpt
open_display

# seen: until the app has ended a frame with all that was sent so far. A loaded machine draws a frame in seconds, and takes what comes meanwhile as one:
# a button let go and the next place of the pointer would be a longer drag.
marks=0
seen() {
    marks=$((marks + 1))
    xdotool key F12
    await "mark $marks\$" >/dev/null
}
move() { xdotool mousemove "$1" "$2" && seen; }
# drag X1 Y1 X2 Y2 [SECONDS]: with the left button, in steps as a hand makes them, and held so long at the end.
drag() {
    move "$1" "$2"
    xdotool mousedown 1
    local i
    for i in $(seq 1 24); do
        move $(($1 + ($3 - $1) * i / 24)) $(($2 + ($4 - $2) * i / 24))
        sleep 0.12
    done
    sleep "${5:-0.5}"
    xdotool mouseup 1
    seen
}
# press NUMBER X Y: stroke NUMBER, held until the tool is as deep as it goes.
press() {
    move "$2" "$3"
    xdotool mousedown 1
    await "stroke $1 is as deep as it goes" >/dev/null
    sleep 0.5
    xdotool mouseup 1
    seen
}
picture() { seen && sleep 1 && import -window root -depth 8 "$out/$1.png"; }
# number_in LINE NAME: the number after NAME.
number_in() { sed -E "s/.*$2 ([0-9.]+).*/\1/" <<<"$1"; }
is_more() { awk "BEGIN { exit !($1 > $2) }"; }

"$sculpt" --check --out "$out" --engine native >"$out/log" 2>&1 &
app=$!
await "the clay is shown" >/dev/null
# There is no window manager to give the window the keyboard.
xdotool windowfocus --sync "$(xdotool search --name '^bevy_clay$' | head -n 1)"
picture 1_start

press 1 600 290
stroke=$(await "stroke 1 ball")
echo "$stroke"
move 640 690
picture 2_dent
is_more "$(number_in "$stroke" dent)" 0.5 || fail "the press left no dent"
soft=$(number_in "$stroke" "up to")
# The yield stress to about 60 kPa, and the same press beside the first.
drag 154 78 196 78
press 2 760 300
stroke=$(await "stroke 2 ball")
echo "$stroke"
hard=$(number_in "$stroke" "up to")
is_more "$hard" "$soft * 1.3" || fail "firmer clay presses back with $hard N, soft clay did with $soft N"
picture 3_firm

xdotool key u
await "taken back"
drag 196 78 154 78
# A groove in three seconds. How fast clay and window went is printed: it says as much of the machine's load as of them.
drag 480 320 780 300
stroke=$(await "stroke 3 ball")
echo "$stroke"
move 640 690
picture 4_groove
is_more "$(number_in "$stroke" dent)" 0.5 || fail "the drag left no groove"
is_more 3 "$(number_in "$stroke" "up to")" || fail "the groove took $(number_in "$stroke" "up to") N, soft clay takes less than 3"
grep -q "1 bodies before, 1 bodies now" <<<"$stroke" || fail "the drag tore the clay"

xdotool key 5
seen
# The knife goes along the line that was drawn, as fast as the clay can follow.
drag 690 130 560 690
stroke=$(await "stroke 4 knife")
echo "$stroke"
move 640 720
picture 5_cut
grep -q "1 bodies before, 2 bodies now" <<<"$stroke" || fail "the knife did not cut the clay in two"

# Coarser cells: the shape is filled anew, and is still two bodies.
drag 161 331 171 331
await "stands on cells"
xdotool key h
picture 6_help
xdotool key h
# The inspector opens by its title.
move 24 775
xdotool click 1
picture 7_inspector
xdotool click 1 key e
await "wrote"
[ -s "$out/clay-001.stl" ] || fail "no exported file"
rm -f "$out"/clay-*.stl

xdotool key Escape
for _ in $(seq $((10 * patience))); do kill -0 "$app" 2>/dev/null && sleep 0.1 || break; done
status=0
wait "$app" || status=$?
app=""
grep "frames in" "$out/log"
[ "$status" -eq 0 ] || fail "sculpt ended with code $status"
echo "pictures in $out"
