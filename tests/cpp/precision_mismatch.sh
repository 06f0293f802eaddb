#!/bin/sh
# A host compiled for one precision of Bullet must not link with a library of the other, and the linker's message must
# say why: a function that exists in both precisions under different names.
#
#   precision_mismatch.sh STATICLIB [WORK]
#
# CXX, CXXFLAGS, PKG_CONFIG and STATIC_LIBS as in the Makefile.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
library=$1
work=${2:-$(mktemp -d)}
CXX=${CXX:-c++}
PKG_CONFIG=${PKG_CONFIG:-pkg-config}
STATIC_LIBS=${STATIC_LIBS:--lgcc_s -lutil -lrt -lpthread -lm -ldl -lc}
mkdir -p "$work"

# The smallest host: the guard must not depend on what else a host calls.
cat >"$work/host.cpp" <<'HOST'
#include "isocoat_bullet.hpp"

int main(int argc, char **) {
    if (argc > 1) {
        isocoat::bullet::coupler coupler(nullptr, nullptr);
    }
}
HOST

link() { # precision of the host, precision of the library
    # shellcheck disable=SC2046,SC2086
    LC_ALL=C $CXX -std=c++17 $optimisation ${CXXFLAGS:-} -I"$root/include" -I"$root/bindings/bullet" \
        $($PKG_CONFIG --cflags "$1" | sed 's/-I/-isystem /g') "$work/host.cpp" -o "$work/host" \
        "$library" $($PKG_CONFIG --libs "$2") $STATIC_LIBS >"$work/message" 2>&1
}

fail() {
    echo "FAIL  $1"
    cat "$work/message"
    exit 1
}

refused() { # precision of the host, precision of the library, what the message must name
    if link "$1" "$2"; then
        fail "a host compiled for $1 links with $2 ($optimisation)"
    fi
    grep -qF "$3" "$work/message" || fail "the message does not name $3"
    if grep 'undefined reference' "$work/message" | grep -qvF "$3"; then
        fail "something else is missing, so the guard alone has not been tried"
    fi
    echo "ok    compiled for $1, linked with $2 ($optimisation): refused, naming $3"
}

for optimisation in -O0 -O2; do
    for precision in bullet bullet-float64; do
        link $precision $precision || fail "a host compiled for $precision does not link with $precision"
        "$work/host" || fail "a host compiled for $precision does not run"
        echo "ok    compiled for $precision, linked with $precision ($optimisation)"
    done
    refused bullet bullet-float64 'btRigidBody::setDamping(float, float)'
    refused bullet-float64 bullet 'btRigidBody::setDamping(double, double)'
done
