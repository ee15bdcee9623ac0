#!/usr/bin/env bash
# Sculpts in a headset that is none: `sculpt --xr` on Monado, whose head and hands a script moves, in a Debian of its own (a folder that is
# made once, XR_ROOT or target/monado) and without a network. What is built has to be there: sculpt with the feature xr, and headless.
#   bash scripts/xr_test.sh [--root] [RESULTS]
# With --root the folder is made and no more.
# Its last line says `skipped: REASON` where that cannot be done: it takes root, unshare, and a network to make the folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}
examples=$CARGO_TARGET_DIR/debug/examples
root=${XR_ROOT:-$CARGO_TARGET_DIR/monado}
mirror=${XR_MIRROR:-http://deb.debian.org/debian}
# As it was tried: Monado 25.0 of Debian 13.
packages=(monado-service libopenxr1-monado libopenxr-loader1 mesa-vulkan-drivers)

skip() {
    echo "skipped: $1"
    exit 0
}

# make_root FOLDER: Debian with Monado, in that folder. Its mounts end with the namespace that this runs in.
make_root() {
    local part=$1
    debootstrap --variant=minbase trixie "$part" "$mirror" || return 1
    mount -t proc proc "$part/proc" && mount --rbind /dev "$part/dev" || return 1
    # Nothing that is installed there starts anything; and what is lost with the power is made anew.
    printf '#!/bin/sh\nexit 101\n' >"$part/usr/sbin/policy-rc.d"
    chmod +x "$part/usr/sbin/policy-rc.d"
    echo force-unsafe-io >"$part/etc/dpkg/dpkg.cfg.d/unsafe"
    chroot "$part" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 install -y --no-install-recommends "${packages[@]}" </dev/null || return 1
    rm -rf "$part"/var/cache/apt/archives/*.deb
    touch "$part/ready"
}

# prepare_root: what the run needs in it.
prepare_root() {
    mkdir -p "$root"/{xr/bin,xr/out,xr/lib,xr/full,run/user/0,root/.config/monado}
    ln -sf /usr/lib/x86_64-linux-gnu/libopenxr_loader.so.1 "$root/xr/lib/libopenxr_loader.so"
    printf '{"active":"remote","remote":{"version":0,"port":4242}}\n' >"$root/root/.config/monado/config_v0.json"
    rm -f "$root"/run/user/0/monado*
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    mount --bind "$examples" "$root/xr/bin"
    mount --bind "$results" "$root/xr/out"
}

# What runs within the folder, without anything of the environment but these.
inside=(chroot "$root" env -i HOME=/root PATH=/usr/bin:/bin XDG_RUNTIME_DIR=/run/user/0 WGPU_BACKEND=vulkan)

# start_service: Monado, which shows what it is given to nobody. A connection that closes at once would end it, so its log is looked at.
start_service() {
    rm -f "$root"/run/user/0/monado*
    "${inside[@]}" XRT_COMPOSITOR_NULL=1 XRT_NO_STDIN=1 monado-service >"$results/monado.log" 2>&1 </dev/null &
    service=$!
    echo "$service" >"$results/service"
    for _ in $(seq 100); do
        if [ -S "$root/run/user/0/monado_comp_ipc" ] && grep -q "Listening on port" "$results/monado.log"; then
            return
        fi
        sleep 0.1
    done
    echo "Monado does not listen:" >&2
    tail -n 20 "$results/monado.log" >&2
    return 1
}

stop_service() {
    kill "$service" 2>/dev/null || true
    wait "$service" 2>/dev/null || true
}

# run_app NAME ARGUMENT...: sculpt in the headset, by the script of that name.
run_app() {
    local name=$1 status=0
    shift
    start_service
    "${inside[@]}" LD_LIBRARY_PATH=/xr/lib timeout 280 /xr/bin/sculpt --xr --check --script "$@" >"$results/$name.txt" 2>"$results/$name.log" || status=$?
    stop_service
    cat "$results/$name.txt"
    if [ "$status" -ne 0 ] || grep -q "panicked" "$results/$name.log"; then
        echo "sculpt --xr, $name: exit code $status" >&2
        grep -vE '^$|^[[:space:]]+VK_|reference_bounds' "$results/$name.log" | tail -n 20 >&2
        return 1
    fi
}

# lose_runtime: the service is killed in the midst of a session, when the app asks for it.
lose_runtime() {
    rm -f "$results/kill"
    (
        for _ in $(seq 600); do
            [ ! -e "$results/kill" ] || break
            sleep 0.1
        done
        kill -9 "$(cat "$results/service")"
    ) &
    run_app lost --kill /xr/out/kill
    grep -c "does not go on" "$results/lost.log" | grep -qx 1
}

# no_room: the runtime goes, and there is no room for the clay that nobody sees any more: the app says so and ends. A placement that is not there is told, and
# the arm stands by the clay.
no_room() {
    local app status=0
    mount -t tmpfs -o size=16k none "$root/xr/full"
    start_service
    "${inside[@]}" LD_LIBRARY_PATH=/xr/lib timeout 120 /xr/bin/sculpt --xr --arm simulated --placement /no/such.placement.ron --out /xr/full \
        >"$results/full.txt" 2>"$results/full.log" &
    app=$!
    for _ in $(seq 300); do
        if grep -q "hands are the app's" "$results/full.log" && grep -q "is in the hand of" "$results/full.log"; then
            break
        fi
        sleep 0.1
    done
    sleep 3
    kill -9 "$service"
    wait "$app" || status=$?
    stop_service
    if [ "$status" -ne 1 ] || [ "$(grep -c "error: the clay is not saved: .*/xr/full/" "$results/full.log")" -ne 1 ] ||
        [ "$(grep -c "error: /no/such.placement.ron: .*; the arm stands by the clay" "$results/full.log")" -ne 1 ]; then
        echo "sculpt --xr without room for the clay: exit code $status" >&2
        tail -n 20 "$results/full.log" >&2
        return 1
    fi
    grep "^error: " "$results/full.log"
}

# no_runtime: where OpenXR is not there, one line says so and the window is wanted.
no_runtime() {
    local status=0
    "${inside[@]}" /xr/bin/sculpt --xr >"$results/none.txt" 2>"$results/none.log" || status=$?
    if [ "$status" -ne 2 ] || [ "$(grep -c "in a window: OpenXR's loader is not there" "$results/none.log")" -ne 1 ]; then
        cat "$results/none.log" >&2
        return 1
    fi
    echo "without a runtime: $(head -n 1 "$results/none.log")"
}

# all_runs: everything, in namespaces of its own.
all_runs() {
    ip link set lo up
    prepare_root
    no_runtime
    mkdir -p "$results/eyes"
    run_app sculpt --record /xr/out/run.clayrun --screenshot /xr/out/eyes.png
    run_app arm --arm simulated
    lose_runtime
    no_room
    # On the same libraries: what they round differs.
    "${inside[@]}" /xr/bin/headless --replay /xr/out/run.clayrun | tee "$results/replay.txt"
    grep -q "the same bits" "$results/replay.txt"
    echo "all runs in the headset passed; $SECONDS s"
}

case ${1:-} in
--make)
    make_root "$2"
    exit
    ;;
--runs)
    results=$2
    all_runs
    exit
    ;;
--root)
    makes_only=1
    shift
    ;;
esac
# Namespaces of network, mounts and processes: whatever ends this script, no mount and no service is left.
apart=(unshare --net --mount --pid --fork --kill-child)
[ "$(uname -s)" = Linux ] || skip "Monado is made for Linux here"
[ "$(uname -m)" = x86_64 ] || skip "the folder is made for x86_64"
[ "$(id -u)" -eq 0 ] || skip "namespaces and chroot take root"
"${apart[@]}" true 2>/dev/null || skip "no namespaces here (${apart[*]})"
command -v ip >/dev/null || skip "iproute2 is not installed"
results=$(mkdir -p "${1:-$CARGO_TARGET_DIR/checks/xr}" && cd "${1:-$CARGO_TARGET_DIR/checks/xr}" && pwd)
if [ ! -e "$root/ready" ]; then
    [ ! -e "$root" ] || skip "$root is there, and is no Debian of this script"
    command -v debootstrap >/dev/null || skip "debootstrap is not installed"
    echo "making $root, once: Debian 13 with Monado"
    # What is made by half has another name.
    rm -rf "$root.part"
    mkdir -p "$root.part"
    if ! unshare --mount --pid --fork --kill-child bash "${BASH_SOURCE[0]}" --make "$root.part" >"$results/root.log" 2>&1; then
        rm -rf "$root.part"
        skip "Debian 13 with Monado could not be made: $(grep -v '^$' "$results/root.log" | tail -n 1)"
    fi
    mv "$root.part" "$root"
    echo "made in $SECONDS s"
fi
[ -z "${makes_only:-}" ] || exit 0
export XR_ROOT=$root
exec "${apart[@]}" bash "${BASH_SOURCE[0]}" --runs "$results"
