#!/usr/bin/env bash
# Installs what a bare Debian or Ubuntu with Rust lacks: a C compiler, which Rust links with, and certificates, which cargo
# downloads with; with --window also what a window loads at run time: X libraries, the Vulkan loader and, where no Vulkan driver is
# there, a software driver; with --test a virtual display, a mouse for it, and what a Debian with a virtual headset is made with; with --all-of-bevy what compiling Bevy with its default features
# takes. Components of Rust may be named too:
# bash scripts/install.sh --window --test rustfmt clippy
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

# lacking PACKAGE...: adds those that are not installed. Where there is no dpkg, the names mean nothing and are left to the user.
lacking() {
    command -v dpkg-query >/dev/null || return 0
    local package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q "ok installed" || packages+=("$package")
    done
}
components=()
for argument in "$@"; do
    case $argument in
    --window)
        lacking libvulkan1 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 libxrandr2
        compgen -G "/usr/share/vulkan/icd.d/*.json" >/dev/null || compgen -G "/etc/vulkan/icd.d/*.json" >/dev/null ||
            lacking mesa-vulkan-drivers
        ;;
    --all-of-bevy) lacking pkg-config libasound2-dev libudev-dev libwayland-dev ;;
    --test) lacking xvfb xauth xdotool imagemagick debootstrap iproute2 ;;
    *) components+=("$argument") ;;
    esac
done

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

for component in "${components[@]}"; do
    tool=${component/rustfmt/fmt}
    cargo "$tool" --version >/dev/null 2>&1 && continue
    command -v rustup >/dev/null || fail "cargo $tool is missing; install the Rust component $component by hand"
    echo "install.sh: installing the Rust component $component by rustup"
    rustup --quiet component add "$component" || fail "rustup could not add $component"
done
