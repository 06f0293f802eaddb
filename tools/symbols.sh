#!/bin/sh
# The exported functions are exactly those in tests/abi/symbols.txt, the header declares each of them and no other, and
# the static library has them too: `symbols.sh SHARED STATIC check|update`.
set -eu
cd "$(dirname "$0")/.."
shared=$1 static=$2 mode=$3
list=tests/abi/symbols.txt
header=include/isocoat/isocoat.h
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export LC_ALL=C

differ() { # what, expected, actual
    diff -u "$2" "$3" >"$scratch/diff" && return 0
    echo "$1:"
    sed -n '/^[-+][^-+]/p' "$scratch/diff"
    return 1
}

nm -D --defined-only --format=posix "$shared" | cut -d' ' -f1 | sort >"$scratch/shared"
if [ "$mode" = update ]; then
    mkdir -p "$(dirname "$list")"
    cp "$scratch/shared" "$list"
    echo "$list: $(wc -l <"$list") functions"
    exit 0
fi
[ -f "$list" ] || { echo "$list is missing: make symbols writes it"; exit 1; }

differ "exports differ from $list (- listed, + exported; make symbols accepts them)" "$list" "$scratch/shared"

nm --defined-only --extern-only --format=posix "$static" 2>/dev/null | awk '$2 == "T" { print $1 }' |
    grep '^isocoat_' | sort >"$scratch/static"
differ "the static library differs from $list (- listed, + in the library)" "$list" "$scratch/static"

# Without comments, a name before a parenthesis is a declaration, an inline definition, or a call inside one.
echo "#include <isocoat/isocoat.h>" | ${CC:-cc} -Iinclude -E -P - | tr '\n' ' ' >"$scratch/header"
grep -oE 'isocoat_[a-z0-9_]+ *\(' "$scratch/header" | tr -d ' (' | sort -u >"$scratch/named"
grep -oE 'static inline [^();{}]*\(' "$scratch/header" | grep -oE 'isocoat_[a-z0-9_]+ *\(' | tr -d ' (' |
    sort -u >"$scratch/inline"
comm -23 "$scratch/named" "$scratch/inline" >"$scratch/declared"
differ "$header differs from $list (- listed, + declared)" "$list" "$scratch/declared"

echo "$(wc -l <"$list") functions, the same in list, header, shared and static library"
