# shellcheck shell=bash
# For scripts that work windows with a mouse that nobody holds: a virtual display, and an app on it. Sourced; the script has set `out`, the folder of
# `log` and of the pictures, and `name`, its own.
# Needs xvfb, xdotool and imagemagick, and a Vulkan driver, software or not: bash scripts/install.sh --window --test

fail() {
    echo "$name: $1" >&2
    tail -n 20 "$out/log" >&2 || true
    exit 1
}

xvfb="" app=""
# Ends what was started.
leave() {
    [ -z "$app" ] || kill "$app" 2>/dev/null || true
    [ -z "$xvfb" ] || kill "$xvfb" 2>/dev/null || true
}
trap leave EXIT

# The first display that is free.
open_display() {
    local tool number
    for tool in Xvfb xdotool import; do
        command -v "$tool" >/dev/null || fail "$tool is missing: bash scripts/install.sh --window --test"
    done
    number=$(mktemp)
    Xvfb -displayfd 3 -screen 0 1280x800x24 3>"$number" 2>/dev/null &
    xvfb=$!
    for _ in $(seq 1200); do [ -s "$number" ] && break || sleep 0.1; done
    [ -s "$number" ] || fail "no virtual display"
    DISPLAY=:$(cat "$number")
    export DISPLAY
    rm -f "$number"
}

# Longest wait for a line of the log [s]: it guards against hanging, and says nothing of speed.
patience=900
# await PATTERN: until the log holds a line like that, which it prints.
await() {
    local end=$((SECONDS + patience))
    until grep -m1 -- "$1" "$out/log"; do
        kill -0 "$app" 2>/dev/null || fail "it ended early"
        [ "$SECONDS" -lt "$end" ] || fail "nothing like \"$1\" within $patience s"
        sleep 0.2
    done
}
