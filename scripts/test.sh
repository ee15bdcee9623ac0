#!/usr/bin/env bash
# Every check of the project, cheap ones first; stops at the first that fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# One target folder for all sections, named even if it is the default: `cargo package` and the outside crate share it.
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
export CARGO_TARGET_DIR CARGO_TERM_PROGRESS_WHEN=never
results=$CARGO_TARGET_DIR/checks
mkdir -p "$results"

current=start
finish() {
    local status=$?
    [ -z "${outside:-}" ] || rm -rf "$outside"
    [ "$status" -eq 0 ] || printf '\n== FAILED in "%s" after %d s\n' "$current" "$SECONDS" >&2
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

run_examples() {
    local example scene name
    for example in examples/*.rs examples/*/main.rs; do
        [ -e "$example" ] || continue
        name=${example#examples/}
        name=${name%/main.rs}
        name=${name%.rs}
        case $name in
        headless)
            for scene in assets/scenes/*.ron; do
                echo "headless $scene, 3 frames"
                cargo run --quiet --no-default-features --example headless -- "$scene" \
                    --out "$results/$(basename "$scene" .ron)" --frames 3
            done
            ;;
        validate) ;; # has a section of its own
        *)
            echo "example $name is not run by scripts/test.sh: add it" >&2
            return 1
            ;;
        esac
    done
}

validate() {
    # In the dev profile, which is optimised too and is built already.
    cargo run --quiet --no-default-features --example validate -- all --quick --json "$results/validate.json"
}

# A crate that is no member of anything depends on this one by its path, without Bevy, and carves.
outside_crate() {
    outside=$(mktemp -d)
    cp -r tests/outside/. "$outside"
    sed "s|BEVY_CLAY_PATH|$PWD|" tests/outside/Cargo.toml.in >"$outside/Cargo.toml"
    # The versions tested here: a release of somebody else's crate must not fail this check.
    cp Cargo.lock "$outside/"
    (cd "$outside" && cargo run --quiet)
}

package() {
    local dirty=()
    [ -n "${CI:-}" ] || dirty=(--allow-dirty)
    # Builds the package as packed, with default features.
    cargo package --quiet "${dirty[@]}"
    local crate size
    crate=$(ls "$CARGO_TARGET_DIR"/package/bevy_clay-*.crate)
    size=$(stat -c %s "$crate")
    echo "$crate: $((size / 1024)) KiB"
    [ "$size" -le $((2 * 1024 * 1024)) ] || {
        echo "the package is larger than 2 MiB: see include in Cargo.toml" >&2
        return 1
    }
}

section "tools" bash scripts/install.sh rustfmt clippy
section "format" cargo fmt --check
section "scripts" check_scripts
section "lints without Bevy" cargo clippy --quiet --no-default-features --all-targets -- -D warnings
section "tests without Bevy" cargo test --quiet --no-default-features --lib --tests --examples
section "doc tests without Bevy" cargo test --quiet --no-default-features --doc
section "examples" run_examples
section "bad input" bash scripts/bad_input.sh
section "validate, quick" validate
section "crate outside" outside_crate
section "lints with Bevy" cargo clippy --quiet --all-targets -- -D warnings
section "tests with Bevy" cargo test --quiet --test plugin
section "doc tests with Bevy" cargo test --quiet --doc
section "docs" env RUSTDOCFLAGS="-D warnings" cargo doc --quiet --no-deps
section "package" package

printf '\n== all checks passed in %d s; results in %s\n' "$SECONDS" "$results"
