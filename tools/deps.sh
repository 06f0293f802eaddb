#!/bin/sh
# Fetches what a target lacks: `deps.sh demo` (fails only without cargo or a C compiler), `deps.sh test` (fails when
# anything stays missing). Quick and silent when everything is there.
set -u
cd "$(dirname "$0")/.." || exit 1
purpose=${1:-test}

have() { command -v "$1" >/dev/null 2>&1; }
have_package() { have pkg-config && pkg-config --exists "$1" 2>/dev/null; }

# Names of Debian packages that are missing.
missing_packages() {
    have cc || have gcc || echo gcc
    # A C library without headers comes with a bare gcc.
    [ -e /usr/include/stdio.h ] || [ "$(uname -s)" != Linux ] || echo libc6-dev
    have c++ || have g++ || echo g++
    have pkg-config || echo pkg-config
    have_package bullet || echo libbullet-dev
    [ "$purpose" = test ] || return 0
    # Single precision is "bullet", double precision "bullet-float64".
    if have_package bullet && ! have_package bullet-float64; then
        echo libbullet-dev
    fi
    have make || echo make
    have cmake || echo cmake
    have valgrind || echo valgrind
    have readelf || echo binutils
    if grep -qs cmocka.h tests/c/*.c && ! have_package cmocka; then
        echo libcmocka-dev
    fi
}

as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif ! have sudo; then
        return 1
    elif [ -t 0 ]; then
        sudo "$@"
    else
        sudo -n "$@"
    fi
}

install_packages() {
    echo "Installing:" "$@"
    have apt-get || { echo "There is no apt-get here."; return 1; }
    set -- apt-get install -y --no-install-recommends "$@"
    # Lists of packages may be absent or old: a second try with fresh ones.
    as_root env DEBIAN_FRONTEND=noninteractive "$@" >/dev/null 2>&1 && return 0
    as_root apt-get update -q >/dev/null || return 1
    as_root env DEBIAN_FRONTEND=noninteractive "$@" >/dev/null
}

if ! have cargo; then
    echo "cargo is missing: install a stable Rust toolchain (https://rustup.rs), 1.89 or later." >&2
    exit 1
fi

missing=$(missing_packages)
if [ -n "$missing" ]; then
    # shellcheck disable=SC2086 # one word a package
    install_packages $missing || true
    missing=$(missing_packages)
fi

if [ "$purpose" = test ]; then
    for component in clippy rustfmt; do
        case $component in clippy) probe="cargo clippy" ;; rustfmt) probe="cargo fmt" ;; esac
        $probe --version >/dev/null 2>&1 && continue
        if have rustup; then
            echo "Installing: $component"
            rustup component add "$component" >/dev/null 2>&1
        fi
        $probe --version >/dev/null 2>&1 || missing="$missing $component"
    done
fi

# shellcheck disable=SC2086,SC2116 # newlines become spaces
missing=$(echo $missing)
[ -z "$missing" ] && exit 0
case "$purpose $missing " in
*" gcc "* | *" libc6-dev "* | test*)
    echo "Could not install: $missing. Install these (names of Debian packages, rustup components), then try again." >&2
    exit 1
    ;;
esac
echo "Could not install: $missing. The demo goes on without."
