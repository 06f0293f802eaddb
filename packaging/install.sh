#!/bin/sh
# Installs libraries, headers, pkg-config and CMake files under $DESTDIR$PREFIX. Called by make, which sets
# VERSION, STATIC_LIBS, STATICLIB, SHAREDLIB, PREFIX, DESTDIR, LIBDIR and INCLUDEDIR (the last two relative to PREFIX).
set -eu
cd "$(dirname "$0")/.."

for dir in "$LIBDIR" "$INCLUDEDIR"; do
    case $dir in
    /* | *..*) echo "LIBDIR and INCLUDEDIR are relative to PREFIX, without '..': $dir" >&2 && exit 1 ;;
    esac
done
case $PREFIX in
/*) ;;
*) PREFIX=$PWD/$PREFIX ;;
esac

root=$DESTDIR$PREFIX
lib=$root/$LIBDIR
include=$root/$INCLUDEDIR/isocoat

# The library itself knows the name it is looked up by (build.rs); the file carries the whole version.
case $SHAREDLIB in
*.dylib)
    soname=$(otool -D "$SHAREDLIB" | sed -n '$s|.*/||p')
    real=libisocoat.$VERSION.dylib
    link=libisocoat.dylib
    ;;
*)
    soname=$(readelf -d "$SHAREDLIB" | sed -n 's/.*(SONAME).*\[\(.*\)\]/\1/p')
    real=libisocoat.so.$VERSION
    link=libisocoat.so
    ;;
esac
[ -n "$soname" ] || { echo "$SHAREDLIB has no SONAME" >&2 && exit 1; }

# From a folder relative to the prefix back to the prefix, so that an installed tree can be moved.
up() { echo "$1" | sed 's|//*|/|g; s|/$||; s|[^/][^/]*|..|g'; }

expand() { # template, target
    sed -e "s|@VERSION@|$VERSION|g" -e "s|@LIBDIR@|$LIBDIR|g" -e "s|@INCLUDEDIR@|$INCLUDEDIR|g" \
        -e "s|@STATIC_LIBS@|$STATIC_LIBS|g" -e "s|@SONAME@|$soname|g" -e "s|@SHARED@|$real|g" \
        -e "s|@STATIC_LIBS_LIST@|$(echo "$STATIC_LIBS" | tr -s ' ' ';')|g" \
        -e "s|@UP_FROM_PKGCONFIG@|$(up "$LIBDIR/pkgconfig")|g" -e "s|@UP_FROM_CMAKE@|$(up "$LIBDIR/cmake/isocoat")|g" \
        "$1" >"$2"
    chmod 644 "$2"
}

install -d "$lib/pkgconfig" "$lib/cmake/isocoat" "$include" "$root/share/doc/isocoat"
install -m 644 "$STATICLIB" "$lib/libisocoat.a"
install -m 755 "$SHAREDLIB" "$lib/$real"
ln -sf "$real" "$lib/$soname"
ln -sf "$soname" "$lib/$link"
for header in include/isocoat/*.h include/isocoat/*.hpp bindings/*/*.hpp; do
    [ ! -f "$header" ] || install -m 644 "$header" "$include/"
done
expand packaging/isocoat.pc.in "$lib/pkgconfig/isocoat.pc"
expand packaging/isocoat-static.pc.in "$lib/pkgconfig/isocoat-static.pc"
expand packaging/isocoat-config.cmake.in "$lib/cmake/isocoat/isocoat-config.cmake"
expand packaging/isocoat-config-version.cmake.in "$lib/cmake/isocoat/isocoat-config-version.cmake"
install -m 644 LICENSE-MIT LICENSE-APACHE CHANGELOG.md "$root/share/doc/isocoat/"
echo "isocoat $VERSION is in $root"
