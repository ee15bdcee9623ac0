#!/usr/bin/env bash
# Sculpts in a window with a mouse that nobody holds: a virtual display, the example `sculpt`, real mouse and key events. Checks that a press dents the
# clay where it was made, that the knife cuts it in two, that a slider changes what the tool feels, that undo takes back. Pictures go to out/window.
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
cargo build --quiet -p bevy_clay --features "demo inspector" --example sculpt
sculpt=${CARGO_TARGET_DIR:-target}/debug/examples/sculpt
open_display

# A loaded machine draws a frame in seconds and would not see a hand that does not wait for it: all pauses are `pace` times as long.
pace=1
pause() { sleep "$(awk "BEGIN { print $1 * $pace }")"; }
# move X Y: where a slow machine has seen the pointer before the next event.
move() { xdotool mousemove "$1" "$2" && pause 0.3; }
# drag X1 Y1 X2 Y2: with the left button, in steps, as a hand does.
drag() {
    move "$1" "$2"
    xdotool mousedown 1
    local i
    for i in $(seq 1 24); do
        xdotool mousemove $(($1 + ($3 - $1) * i / 24)) $(($2 + ($4 - $2) * i / 24))
        pause 0.12
    done
    pause "${5:-0.5}"
    xdotool mouseup 1
    pause 0.3
}
# press NUMBER X Y: stroke NUMBER, held until the tool is as deep as it goes.
press() {
    move "$2" "$3"
    xdotool mousedown 1
    await "stroke $1 is as deep as it goes" >/dev/null
    pause 0.5
    xdotool mouseup 1
    pause 0.3
}
picture() { pause 1 && import -window root -depth 8 "$out/$1.png"; }
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
# 300 ms is what two idle cores take.
pace=$(awk "BEGIN { p = $(number_in "$stroke" "answered in") / 300; print p < 1 ? 1 : (p > 8 ? 8 : p) }")

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
move 640 690
xdotool key 5
pause 0.5
drag 690 130 560 690 4
stroke=$(await "stroke 3 knife")
echo "$stroke"
move 640 720
picture 4_cut
grep -q "1 bodies before, 2 bodies now" <<<"$stroke" || fail "the knife did not cut the clay in two"

# Coarser cells: the shape is filled anew, and is still two bodies.
drag 161 310 171 310
await "stands on cells"
xdotool key h
picture 5_help
xdotool key h
# The inspector opens by its title.
move 24 775
xdotool click 1
picture 6_inspector
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
