#!/usr/bin/env bash
# Every check of the project, cheap ones first; stops at the first that fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# One target folder for all sections, named even if it is the default: `cargo package` and the outside crate share it.
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
# As .cargo/config.toml has it for what runs under cargo.
export WGPU_BACKEND=${WGPU_BACKEND:-vulkan} XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-$CARGO_TARGET_DIR}
export CARGO_TARGET_DIR CARGO_TERM_PROGRESS_WHEN=never
# install.sh has seen to a Vulkan driver: on a build machine its absence is a fault, elsewhere the tests that need it are ignored.
[ -z "${CI:-}" ] || export CLAY_GPU=${CLAY_GPU:-require}
# Where all is built once, what would make a second build shorter only makes the first one longer: 16 % of the crate's own. So do the lines of a
# backtrace, 5 %: a panic says where it is without them. In one unit a crate takes a quarter less of a processor than in 16, and its code is 15 %
# faster; there are other crates for the other cores. What is optimised across the two units of other crates takes a tenth of their time (bevy_pbr: 225
# and 203 s).
[ -z "${CI:-}" ] || export CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=false CARGO_PROFILE_DEV_CODEGEN_UNITS=1 CARGO_PROFILE_DEV_LTO=off
results=$CARGO_TARGET_DIR/checks
# All that draws, with one set of features: another would compile Bevy once more.
with_bevy=(-p bevy_clay --features "demo inspector xr")
# All there is, for what need not be built to be read.
everything=(--workspace --features "bevy_clay/demo bevy_clay/inspector bevy_clay/xr")
mkdir -p "$results"

current=start table=""
finish() {
    local status=$?
    [ -z "${outside:-}" ] || rm -rf "$outside"
    [ -z "${root:-}" ] || kill "$root" 2>/dev/null || true
    printf '\n%s' "$table"
    # A run that was killed may have no status of its own.
    if [ "$status" -eq 0 ] && [ "$current" = end ]; then
        printf '== all checks passed in %d s; results in %s\n' "$SECONDS" "$results"
    else
        printf '== FAILED in "%s" after %d s\n' "$current" "$SECONDS" >&2
    fi
}
trap finish EXIT

# section TITLE COMMAND...: runs the command under a header and says how long it took.
section() {
    current=$1
    shift
    printf '\n== %s\n' "$current"
    local start=$SECONDS
    "$@"
    printf -- '-- %s: ok, %d s\n' "$current" $((SECONDS - start))
    table+=$(printf '%6d s  %s' $((SECONDS - start)) "$current")$'\n'
}

# run_tests KIND ARGUMENT...: cargo test; then the counts of its tests against those on record. A warning of the compiler fails too: lints see the
# crates with all their features alone.
run_tests() {
    local kind=$1 log=$results/tests
    shift
    cargo test "$@" 2>&1 | grep --line-buffered -vE '^ +(Compiling|Downloading|Downloaded|Finished|Updating|Locking) ' | tee "$log"
    ! grep -q '^warning: ' "$log" || {
        echo "the compiler warns" >&2
        return 1
    }
    check_counts "$kind" "$log"
}

# Unit tests of the modules that are not there without Bevy. They calculate little: what is not optimised is there sooner.
run_unit_tests() {
    CARGO_PROFILE_DEV_OPT_LEVEL=0 run_tests bevy-unit "${with_bevy[@]}" --lib -- --quiet plugin:: ui:: xr::
}

# check_counts KIND LOG: of each suite of that kind as many tests ran as scripts/test_counts.txt has. A test that comes or goes on purpose does so there too.
check_counts() {
    # Where no graphics adapter is required, tests that lack one are ignored by name.
    local counts_ignored=1
    [ "${CLAY_GPU:-}" != require ] || counts_ignored=0
    awk -v kind="$1" -v counts_ignored="$counts_ignored" '
        FNR == NR { if ($1 == kind) { expected[$2] = $3; found[$2] += 0 } next }
        $1 == "Running" { suite = $NF; sub(/.*\//, "", suite); sub(/-[0-9a-f]+\)$/, "", suite) }
        $1 == "Doc-tests" { suite = "doc:" $2 }
        /^test result:/ { found[suite] += $4 + (counts_ignored ? $8 : 0) }
        END {
            for (suite in found) {
                if (found[suite] != expected[suite] + 0) {
                    way = found[suite] < expected[suite] + 0 ? "take those that went on purpose out of" : "add the new ones to"
                    printf "suite %s, %s: %d tests ran, and %d are on record: %s scripts/test_counts.txt\n", suite, kind, found[suite], expected[suite], way
                    is_off = 1
                }
            }
            exit is_off
        }' scripts/test_counts.txt "$2" >&2
}

check_scripts() {
    local script
    for script in scripts/*.sh .ci/run; do
        # The published package has no .ci.
        [ ! -e "$script" ] || bash -n "$script"
    done
    if command -v shellcheck >/dev/null; then
        shellcheck scripts/*.sh
    else
        echo "shellcheck is not installed: syntax checked only"
    fi
}

# Programs and examples that need no Bevy, built once. Every example has to be named here, those in a folder of their own, or run_windows runs it.
run_programs() {
    local example scene bin=$CARGO_TARGET_DIR/debug
    cargo build --quiet --no-default-features --bins --example headless --example doctor
    for example in examples/*.rs examples/*/main.rs; do
        case $example in
        examples/doctor/main.rs | examples/headless/main.rs | examples/sculpt/main.rs | examples/gallery/main.rs) ;;
        examples/*.rs) ;;
        *)
            echo "$example is not run by scripts/test.sh: add it" >&2
            return 1
            ;;
        esac
    done
    # The doctor: nothing there, a Touch of the tests, one that is pulled out.
    ! "$bin/examples/doctor" --library /no/such/libHD.so || return 1
    "$bin/examples/doctor" --library "$bin/deps/libfake_hd.so" --seconds 0.2
    ! FAKEHD_PLAN=unplug@0.05 "$bin/examples/doctor" --library "$bin/deps/libfake_hd.so" --seconds 0.2 || return 1
    # A recording of two ticks, played; one that is none is refused.
    printf '%s\n' "# bevy_clay haptic trace 1" time,x,y,z,qx,qy,qz,qw,vx,vy,vz,buttons,fx,fy,fz 0,0,0,0,0,0,0,1,0,0,0,0,0,0.2,0 0.2,0,0,0,0,0,0,1,0,0,0,0,0,0.3,0 >"$results/force.csv"
    "$bin/examples/doctor" --library "$bin/deps/libfake_hd.so" --play "$results/force.csv"
    ! "$bin/examples/doctor" --library "$bin/deps/libfake_hd.so" --play scripts/test.sh || return 1
    for scene in assets/scenes/*.ron; do
        echo "headless $scene, 3 frames"
        "$bin/examples/headless" "$scene" --out "$results/$(basename "$scene" .ron)" --frames 3
    done
    "$bin/stability_map" --out "$results/stability_map" --quick
    "$bin/chart" --smoke --out "$results/chart"
    "$bin/work_precision" --smoke --out "$results/work_precision"
}

# in_window COMMAND...: with the display there is, or one of its own.
in_window() {
    if [ -n "${DISPLAY:-}" ]; then
        timeout 900 "$@"
    else
        timeout 900 xvfb-run --auto-servernum --server-args="-screen 0 1280x800x24" "$@"
    fi
}

# Every example with a window, for some frames. Bad arguments of `sculpt` are one line and exit code 2.
run_windows() {
    local status lines bad examples=$CARGO_TARGET_DIR/debug/examples
    cargo build --quiet "${with_bevy[@]}" --examples
    local small=(examples/*.rs)
    small=("${small[@]%.rs}")
    timeout 1800 bash scripts/examples.sh "$results/examples" "${small[@]/#examples/$examples}"
    in_window "$examples/sculpt" --check --script --frames 3000 --screenshot "$results/sculpt.png"
    in_window "$examples/sculpt" --check --arm simulated --script --screenshot "$results/sculpt_arm.png"
    for bad in "--check --frames 0" "--script" "--check --screenshot no.png" "--engine steam" "--scene no_such.ron" "--no-such-thing"; do
        status=0
        # shellcheck disable=SC2086 # a word or two
        DISPLAY=${DISPLAY:-:0} "$examples/sculpt" $bad >"$results/stdout" 2>"$results/stderr" || status=$?
        lines=$(wc -l <"$results/stderr")
        if [ "$status" -ne 2 ] || [ "$lines" -ne 1 ]; then
            echo "sculpt $bad: exit code $status and $lines lines, expected 2 and 1:" >&2
            cat "$results/stderr" >&2
            return 1
        fi
        echo "ok $(cat "$results/stderr")"
    done
    bash scripts/window.sh "$results/window"
    "$examples/headless" assets/scenes/cube_cut.ron --out "$results/pictures" --frames 3 --pictures 2
    "$examples/gallery" --out "$results/gallery" --quick --only half_open
}

# In the dev profile, which is optimised too and is built already. As many suites at a time as there are cores, each with one thread: most cases are too
# small for more, and bits do not depend on threads. Without `speed`, the last of them; by name, which happens to begin with the longest. What they say
# comes suite by suite, when all are through.
validate() {
    local status=0 suite suites validate=$CARGO_TARGET_DIR/debug/validate out=$results/validate
    mkdir -p "$out"
    suites=$("$validate" --help | sed -n '/- speed:/q; s/^ *- \([a-z]*\):.*/\1/p' | sort)
    [ -n "$suites" ] || {
        echo "validate --help names no suite" >&2
        return 1
    }
    # shellcheck disable=SC2016 # expanded by that shell
    RAYON_NUM_THREADS=1 xargs -P "$(nproc)" -I SUITE sh -c '"$1" "$3" --quick --json "$2/$3.json" >"$2/$3" 2>&1' sh "$validate" "$out" SUITE <<<"$suites" || status=$?
    for suite in $suites; do
        cat "$out/$suite"
    done
    # Once more where the last lines are all that is read.
    # shellcheck disable=SC2086 # names without spaces
    [ "$status" -eq 0 ] || (cd "$out" && grep -HE 'FAIL: |panicked|^error' $suites >&2) || true
    return "$status"
}

# The crate as it would be published: small enough.
package() {
    local dirty=() size
    [ -n "${CI:-}" ] || dirty=(--allow-dirty)
    cargo package --quiet -p bevy_clay --no-verify "${dirty[@]}"
    crate=$(ls "$CARGO_TARGET_DIR"/package/bevy_clay-*.crate)
    size=$(stat -c %s "$crate")
    echo "$crate: $((size / 1024)) KiB"
    [ "$size" -le $((2 * 1024 * 1024)) ] || {
        echo "the package is larger than 2 MiB: see include in Cargo.toml" >&2
        return 1
    }
}

# All of it is there: an app that is no member of anything depends on it and presses a ball into clay.
run_outside() {
    outside=$(mktemp -d)
    cp -r tests/outside/. "$outside"
    tar -xf "$crate" -C "$outside"
    sed "s|BEVY_CLAY_PATH|$(basename "$crate" .crate)|" tests/outside/Cargo.toml.in >"$outside/Cargo.toml"
    # Where it runs once, for some frames, code that is less optimised is there sooner.
    local less=()
    [ -z "${CI:-}" ] || less=(--config profile.dev.package.bevy_clay.opt-level=1)
    (cd "$outside" && cargo build --quiet "${less[@]}" --bin outside)
    timeout 900 bash scripts/examples.sh "$results/examples" "$CARGO_TARGET_DIR/debug/outside"
    # Beside all of Bevy and another plugin of its kind no name has two meanings; and the plugin takes no more of Bevy than it names. Each checks a Bevy of
    # its own: on a build machine, whose time is limited, only where it is asked for.
    if [ -z "${CI:-}" ] || [ -n "${CLAY_ALL_OF_BEVY:-}" ]; then
        (cd "$outside" && cargo check --quiet --bin beside --features everything)
        cargo check --quiet -p bevy_clay --no-default-features --features bevy
    fi
}

# In the headset that is none, whose Debian may still be in the making.
sculpt_in_headset() {
    wait "$root" || true
    bash scripts/xr_test.sh "$results/xr"
}

section "tools" bash scripts/install.sh --window --test --all-of-bevy rustfmt clippy
# Most of that waits for the network and for dpkg.
bash scripts/xr_test.sh --root "$results/xr" >"$results/xr_root" 2>&1 &
root=$!
# All of them, for whatever platform: a check reads the whole tree.
section "crates" cargo fetch --quiet --locked
section "format" cargo fmt --check
section "scripts" check_scripts
section "package" package
section "lints" cargo clippy --quiet "${everything[@]}" --all-targets -- -D warnings
section "tests without Bevy" run_tests core --no-default-features --lib --bins --tests --examples -- --quiet
section "doc tests without Bevy" run_tests core-doc --no-default-features --doc -- --quiet
section "programs" run_programs
section "validate, quick" validate
# For what waits for the crate with the plugin there are no others.
[ -z "${CI:-}" ] || export CARGO_PROFILE_DEV_CODEGEN_UNITS=2
section "tests with Bevy" run_tests bevy "${with_bevy[@]}" --test plugin --test gpu_app --example gallery --example sculpt -- --quiet
section "unit tests with Bevy" run_unit_tests
section "examples with Bevy" run_windows
section "a headset that is none" sculpt_in_headset
section "doc tests with Bevy" run_tests bevy-doc "${with_bevy[@]}" --doc -- --quiet
# Of the examples too: without them Cargo chooses features of common crates for which all that Bevy brings would be read once more.
section "docs" env RUSTDOCFLAGS="-D warnings" cargo doc --quiet --no-deps "${everything[@]}" --lib --examples
section "an app outside" run_outside
current=end
