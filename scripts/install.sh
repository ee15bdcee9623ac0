#!/usr/bin/env bash
# Installs what a bare Debian or Ubuntu with Rust lacks: a C compiler, which Rust links with, and certificates, which cargo
# downloads with. Components of Rust may be named as arguments: bash scripts/install.sh rustfmt clippy
# Says in one line what it installs; with everything in place it says nothing.
set -euo pipefail

fail() {
    echo "install.sh: $1" >&2
    exit 1
}

command -v cargo >/dev/null || fail "Rust is missing; install it as https://rustup.rs says, then run this again."

packages=()
command -v cc >/dev/null || packages+=(gcc libc6-dev)
[ -n "${SSL_CERT_FILE:-}" ] || [ -e /etc/ssl/certs/ca-certificates.crt ] || [ -e /etc/pki/tls/certs/ca-bundle.crt ] ||
    [ -e /etc/ssl/cert.pem ] || packages+=(ca-certificates)

if [ ${#packages[@]} -gt 0 ]; then
    command -v apt-get >/dev/null || fail "no apt-get here; install by hand what stands for: ${packages[*]}"
    as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "not root and no sudo; install by hand: apt-get install ${packages[*]}"
        as_root=(sudo)
    fi
    echo "install.sh: installing ${packages[*]} by apt-get"
    log=$(mktemp)
    trap 'rm -f "$log"' EXIT
    apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 "$@" </dev/null >>"$log" 2>&1; }
    if ! { apt update && apt install -y --no-install-recommends "${packages[@]}"; }; then
        fail "apt-get could not install ${packages[*]}: $(grep -v '^$' "$log" | tail -n 1)"
    fi
fi

for component in "$@"; do
    tool=${component/rustfmt/fmt}
    cargo "$tool" --version >/dev/null 2>&1 && continue
    command -v rustup >/dev/null || fail "cargo $tool is missing; install the Rust component $component by hand"
    echo "install.sh: installing the Rust component $component by rustup"
    rustup --quiet component add "$component" || fail "rustup could not add $component"
done
