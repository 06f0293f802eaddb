#!/bin/sh
# Installs into a scratch prefix, moves it, and uses it as hosts do: pkg-config and CMake, C and C++, shared and static;
# compiles the programs in the documents against it. `make test-install` sets the variables.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
: "${CC:=cc}" "${CXX:=c++}" "${PKG_CONFIG:=pkg-config}" "${MAKE:=make}"
export LC_ALL=C

say() { printf '%s\n' "-- $*"; }
die() {
    printf 'install test: %s\n' "$*" >&2
    exit 1
}
same() { # what, expected, actual
    [ "$2" = "$3" ] || die "$1: expected '$2', found '$3'"
}

case $VERSION in
0.*) abi=$(echo "$VERSION" | cut -d. -f1,2) ;;
*) abi=$(echo "$VERSION" | cut -d. -f1) ;;
esac
soname=libisocoat.so.$abi

rm -rf "$WORK"
mkdir -p "$WORK/bin"

say "the static link line is what rustc asks for, and what the README says"
printf 'extern crate isocoat;\n' >"$WORK/probe.rs"
asked=$(rustc --edition 2024 --crate-type staticlib --print native-static-libs -o "$WORK/libprobe.a" \
    --extern "isocoat=$TARGET/release/libisocoat.rlib" -L "dependency=$TARGET/release/deps" "$WORK/probe.rs" 2>&1 |
    sed -n 's/^note: native-static-libs: *//p')
same "static link line" "$asked" "$STATIC_LIBS"
rm "$WORK/libprobe.a"
grep -qF -- "$STATIC_LIBS" "$root/README.md" || die "README.md does not give the static link line: $STATIC_LIBS"

say "install, with DESTDIR"
"$MAKE" -C "$root" install DESTDIR="$WORK/package" PREFIX=/opt/isocoat LIBDIR=lib INCLUDEDIR=include
prefix=$WORK/package/opt/isocoat
for file in lib/libisocoat.a "lib/libisocoat.so.$VERSION" lib/pkgconfig/isocoat.pc lib/pkgconfig/isocoat-static.pc \
    lib/cmake/isocoat/isocoat-config.cmake lib/cmake/isocoat/isocoat-config-version.cmake \
    include/isocoat/isocoat.h include/isocoat/isocoat.hpp include/isocoat/isocoat_bullet.hpp \
    include/isocoat/isocoat_bullet_bodies.hpp include/isocoat/isocoat_bullet_multibody.hpp \
    share/doc/isocoat/LICENSE-MIT share/doc/isocoat/LICENSE-APACHE; do
    [ -f "$prefix/$file" ] || die "$file was not installed"
done
same "link libisocoat.so" "$soname" "$(readlink "$prefix/lib/libisocoat.so")"
same "link $soname" "libisocoat.so.$VERSION" "$(readlink "$prefix/lib/$soname")"
same "SONAME" "$soname" "$(readelf -d "$prefix/lib/libisocoat.so" | sed -n 's/.*(SONAME).*\[\(.*\)\]/\1/p')"
if grep -rnE '@[A-Z_]+@|/opt/isocoat' "$prefix/lib/pkgconfig" "$prefix/lib/cmake"; then
    die "these lines keep a placeholder or the first prefix"
fi

say "move the prefix"
mv "$prefix" "$WORK/moved"
prefix=$WORK/moved
export PKG_CONFIG_PATH="$prefix/lib/pkgconfig"

# What a program or library may load besides isocoat itself.
plain_libraries='(lib(c|m|gcc_s|stdc\+\+|dl|rt|util|pthread)|ld-linux[-a-z0-9_]*|linux-vdso)\.so\.[0-9]+'
check_libraries() { # file, the isocoat it should load, or nothing
    ldd "$1" | awk '{ print ($2 == "=>") ? $1 " " $3 : $1 }' | while read -r name path; do
        case $name in
        libisocoat*)
            [ -n "$2" ] || die "$1 loads $name although it was linked statically"
            same "library loaded by $1" "$2" "$path"
            ;;
        *) echo "${name##*/}" | grep -qxE "$plain_libraries" || die "$1 loads $name" ;;
        esac
    done
    [ -z "$2" ] || readelf -d "$1" | grep -q "NEEDED.*\[$soname\]" || die "$1 does not ask for $soname"
}
check_libraries "$prefix/lib/$soname" ""

warnings='-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wcast-qual -Werror'
c_flags="-std=c11 $warnings -Wstrict-prototypes -Wmissing-prototypes"
cxx_flags="-std=c++17 $warnings"
rpath=-Wl,-rpath,$prefix/lib
# shellcheck disable=SC2046,SC2086 # flags are lists of words
build_and_run() { # name, package, expected library, extra flags for pkg-config and the linker
    $CC $c_flags $($PKG_CONFIG --cflags "$2") "$here/host.c" -o "$WORK/bin/$1-c" $($PKG_CONFIG $4 --libs "$2") $5
    $CXX $cxx_flags $($PKG_CONFIG --cflags "$2") "$here/host.cpp" -o "$WORK/bin/$1-cpp" $($PKG_CONFIG $4 --libs "$2") $5
    for program in "$WORK/bin/$1-c" "$WORK/bin/$1-cpp"; do
        "$program" "$($PKG_CONFIG --modversion "$2")"
        check_libraries "$program" "$3"
    done
}

say "each header alone, in the strictest mode of the compiler"
# Included twice, for the guard.
alone() { # header, compiler line
    header=$1 && shift
    printf '#include <isocoat/%s>\n#include <isocoat/%s>\n' "$header" "$header" |
        "$@" -I "$prefix/include" -fsyntax-only -
}
# shellcheck disable=SC2086
{
    for standard in c99 c11 c17; do alone isocoat.h "$CC" $c_flags -std=$standard -x c; done
    for standard in c++11 c++17 c++20; do alone isocoat.h "$CXX" $cxx_flags -std=$standard -x c++; done
    for standard in c++17 c++20; do alone isocoat.hpp "$CXX" $cxx_flags -std=$standard -x c++; done
}
for precision in bullet bullet-float64; do
    for header in isocoat_bullet.hpp isocoat_bullet_bodies.hpp isocoat_bullet_multibody.hpp; do
        # shellcheck disable=SC2046,SC2086
        alone "$header" "$CXX" $cxx_flags $($PKG_CONFIG --cflags $precision | sed 's/-I/-isystem /g') -x c++
    done
done

say "pkg-config, shared"
same "version of the package" "$VERSION" "$($PKG_CONFIG --modversion isocoat)"
build_and_run shared isocoat "$prefix/lib/$soname" "" "$rpath"

say "pkg-config, static beside shared"
build_and_run static isocoat-static "" "" ""

say "the programs in the documents"
for document in README.md docs/embedding.md; do
    # Every block of C with a main is a program.
    awk -v prefix="$WORK/bin/$(basename "$document" .md)" '
        /^```c$/ { block = ""; inside = 1; next }
        /^```/ && inside { inside = 0; if (block ~ /int main/) printf "%s", block > (prefix "-" ++count ".c"); next }
        inside { block = block $0 "\n" }' "$root/$document"
done
for source in "$WORK"/bin/*.c; do
    [ -f "$source" ] || die "no program in the documents"
    program=${source%.c}
    # shellcheck disable=SC2046,SC2086
    $CC $c_flags $($PKG_CONFIG --cflags isocoat) "$source" -o "$program" $($PKG_CONFIG --libs isocoat) $rpath
    echo "${program##*/}:"
    "$program"
done

say "CMake"
configure() { # folder
    cmake -S "$here" -B "$WORK/$1" -DCMAKE_PREFIX_PATH="$prefix" -DWANTED_VERSION="$VERSION" \
        -DCMAKE_C_COMPILER="$CC" -DCMAKE_CXX_COMPILER="$CXX" -DCMAKE_BUILD_TYPE=Release >"$WORK/cmake.log" 2>&1 ||
        { cat "$WORK/cmake.log" && die "CMake does not accept the package"; }
}
configure cmake
cmake --build "$WORK/cmake" >"$WORK/cmake.log" || { cat "$WORK/cmake.log" && die "the CMake hosts do not build"; }
(cd "$WORK/cmake" && ctest --output-on-failure | tail -n 4)
for extension in c cpp; do
    check_libraries "$WORK/cmake/host_${extension}_isocoat" "$prefix/lib/$soname"
    check_libraries "$WORK/cmake/host_${extension}_static" ""
done

say "pkg-config --static, where only the archive is left"
rm "$prefix"/lib/libisocoat.so*
build_and_run archive isocoat "" --static ""

triplet=$($CC -print-multiarch 2>/dev/null || true)
if [ -n "$triplet" ]; then
    say "in lib/$triplet, two folders deep"
    "$MAKE" -C "$root" install DESTDIR="$WORK/multiarch" PREFIX=/usr LIBDIR="lib/$triplet" INCLUDEDIR=include
    prefix=$WORK/multiarch/usr
    PKG_CONFIG_PATH=$prefix/lib/$triplet/pkgconfig
    build_and_run multiarch isocoat "$prefix/lib/$triplet/$soname" "" "-Wl,-rpath,$prefix/lib/$triplet"
    configure cmake-multiarch
fi

rm -rf "$WORK"
echo "installed, moved and linked: pkg-config and CMake, C and C++, shared and static"
