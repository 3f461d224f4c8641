#!/usr/bin/env bash
# Installs what a new machine needs to build, test, simulate and flash the weeder: packages of Debian or Ubuntu, and the Rust
# toolchain of rust-toolchain.toml. It can run again, and keeps what is installed.
#
#     ./setup.sh         all that cargo needs
#     ./setup.sh page    also builds the page, with all that it and its tests need: Node.js 18.19 or later with npm,
#                        Chromium and Firefox ESR
#     ./setup.sh cross   also installs what a release for Windows or for Linux on arm64 needs, and Wine to try it
#     ./setup.sh slurm   also installs Slurm, to try an experiment in shards; several words are possible
set -euo pipefail
cd "$(dirname "$0")"

# For the firmware: the AVR linker and C library, and the programmer; bootloaders, to try it on the virtual Uno. For the virtual Uno
# (simavr): a C compiler, and what its Rust binding needs to be generated and linked.
packages=(
    gcc-avr binutils-avr avr-libc avrdude arduino-core-avr
    build-essential pkg-config clang libclang-dev libelf-dev zlib1g-dev libzstd-dev
)

page=no
targets=()
for word in "$@"; do
    case "$word" in
        page)
            page=yes
            # An installed Node.js is often from another source, and conflicts with Debian's.
            if ! command -v npm >/dev/null; then packages+=(nodejs npm); fi
            for browser in chromium firefox-esr; do
                if command -v "$browser" >/dev/null; then
                    continue
                elif grep -qsE '^ID(_LIKE)?=.*ubuntu' /etc/os-release; then
                    echo "Packages: Ubuntu has no $browser. Only the page's tests need it."
                else
                    packages+=("$browser")
                fi
            done
            # The page's tests measure texts in Hindi.
            if [ -z "$(fc-list :lang=hi 2>/dev/null)" ]; then packages+=(fonts-lohit-deva); fi
            ;;
        cross)
            packages+=(gcc-mingw-w64-x86-64 gcc-aarch64-linux-gnu libc6-dev-arm64-cross wine64)
            targets+=(x86_64-pc-windows-gnu aarch64-unknown-linux-gnu)
            ;;
        slurm)
            packages+=(munge procps slurm-client slurmctld slurmd)
            ;;
        *)
            echo "setup.sh: unknown word \`$word\`. Use no word, or page, cross and slurm." >&2
            exit 1
            ;;
    esac
done

missing=()
if command -v dpkg-query >/dev/null; then
    for package in "${packages[@]}"; do
        state=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
        [ "$state" = installed ] || missing+=("$package")
    done
    if [ ${#missing[@]} -eq 0 ]; then
        echo "Packages: all installed."
    else
        echo "Packages: installing ${missing[*]}"
        root=()
        if [ "$(id -u)" -ne 0 ]; then
            command -v sudo >/dev/null || {
                echo "setup.sh: packages are missing. Run it as root, or install sudo." >&2
                exit 1
            }
            root=(sudo)
        fi
        "${root[@]}" apt-get update -q
        "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
    fi
else
    echo "Packages: this is neither Debian nor Ubuntu. Install your system's versions of:"
    printf '    %s\n' "${packages[@]}"
    echo "libelf is linked from libelf.a. On Fedora, the package elfutils-libelf-devel-static has it."
fi

if ! command -v rustup >/dev/null; then
    echo "setup.sh: rustup is missing. Install it from https://rustup.rs, then run this again." >&2
    exit 1
fi
channel=$(sed -n 's/^channel = "\(.*\)"$/\1/p' rust-toolchain.toml)
targets+=("$(sed -n 's/^targets = \["\(.*\)"\]$/\1/p' rust-toolchain.toml)")
installed=$(rustup component list --installed --toolchain "$channel" 2>/dev/null || true)
are_there() {
    local component
    for component in "$@"; do grep -q "^$component" <<<"$installed" || return 1; done
}
if are_there rust-src rustfmt clippy "${targets[@]/#/rust-std-}"; then
    echo "Rust: $channel is installed."
else
    echo "Rust: installing $channel"
    rustup toolchain install "$channel" --profile minimal --target "$(IFS=,; echo "${targets[*]}")" \
        --component rust-src --component rustfmt --component clippy
fi

if [ "$page" = yes ]; then
    if ! node --eval 'const [major, minor] = process.versions.node.split(".").map(Number); process.exit(major > 18 || (major === 18 && minor >= 19) ? 0 : 1)'; then
        echo "setup.sh: the page needs Node.js 18.19 or later, and this is $(node --version || echo none)." >&2
        echo "Install a newer one from https://nodejs.org, then run this again." >&2
        exit 1
    fi
    echo "Node.js: $(node --version)."
    lock=page/node_modules/.package-lock.json
    if [ ! -e "$lock" ] || [ page/package-lock.json -nt "$lock" ]; then npm --prefix page ci --no-audit --no-fund; fi
    # All builds go into one folder, also if the user's cargo has another. These variables would replace this repository's flags.
    [[ ${CARGO_TARGET_DIR:=target} == /* ]] || CARGO_TARGET_DIR=$PWD/$CARGO_TARGET_DIR
    export CARGO_TARGET_DIR
    unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS CARGO_BUILD_TARGET CARGO_INCREMENTAL
    cargo firmware --quiet
    cargo build --release --quiet --package weeder-cli
    WEEDER=$CARGO_TARGET_DIR/release/weeder npm --prefix page run --silent build
    echo "See it in your browser: cargo serve"
fi

echo "Ready. Try: cargo sim"
