#!/bin/sh
# Records the examples and renders docs/gallery: `gallery.sh EXAMPLES VIEWER RECORDINGS GALLERY [scene…]`. What has been
# recorded already is not recorded again.
set -eu
examples=$1 viewer=$2 recordings=$3 gallery=$4
shift 4
mkdir -p "$recordings" "$gallery"

# record NAME PROGRAM
record() {
    [ -s "$recordings/$1.reel" ] && [ "$recordings/$1.reel" -nt "$2" ] && return
    echo "Recording: $1"
    "$2" --record "$recordings/$1.part" >"$recordings/$1.txt"
    mv "$recordings/$1.part" "$recordings/$1.reel"
}

# show COMMAND NAME PICTURE OPTIONS…
show() {
    command=$1 name=$2 picture=$3
    shift 3
    echo "Rendering: $picture"
    "$viewer" "$command" "$recordings/$name.reel" "$gallery/$picture" "$@"
}

scene() {
    case $1 in
    collision)
        record collision "$examples/collision"
        show film collision collision.png --from 36 --to 58 --speed 0.05 --cut 0,-1,0,0 --paint pressure=55000 \
            --eye 0,-1.2,0.25 --target 0,0,0.09 --width 0.5 --size 320x320
        show still collision collision-view.png --frame 48 \
            --eye 0.35,-1.1,0.3 --target 0,0,0.07 --width 0.42 --size 320x320 ;;
    clover)
        record clover "$examples/clover"
        show film clover clover.png --from 6 --to 210 --step 6 \
            --eye 2.9,-3.4,2.0 --target 0.72,0,0.42 --width 2.75 --size 360x270 ;;
    muscle)
        record muscle "$examples/muscle"
        show film muscle muscle.png --step 4 --paint skeletons \
            --eye 0.2,-1.6,0.45 --target 0.25,0,0.13 --width 0.76 --size 360x230 ;;
    skin)
        record skin "$examples/skin"
        show still skin skin.png \
            --eye -0.5,-1.4,0.5 --target 0.02,-0.05,-0.02 --width 1.15 --size 400x270
        show still skin skin-pressure.png --paint pressure=60000 --hide 1 --hide 2 \
            --eye 0.1,-1.3,-0.7 --target 0.02,-0.03,-0.02 --width 1.0 --size 400x270
        show still skin skin-section.png --paint pressure=60000 --cut 0,-1,0,0 \
            --eye -0.1,-1.5,0.15 --target 0.02,0,-0.05 --width 1.0 --size 400x270 ;;
    jelly)
        record jelly "$examples/jelly"
        show film jelly jelly.png --from 0 --to 100 --step 3 \
            --eye 1.5,-2.1,1.3 --target 0.05,0.1,0.3 --width 1.35 --size 360x300 ;;
    dough)
        record dough "$examples/dough"
        show film dough dough.png --step 7 \
            --eye 0.5,-1.6,0.9 --target 0,0,0.12 --width 1.0 --size 360x250
        show film dough dough-section.png --from 20 --to 200 --step 10 --cut 0,-1,0,0 \
            --eye 0,-1.6,0.25 --target 0,0,0.11 --width 0.75 --size 360x220 ;;
    bowl)
        record bowl "$examples/cpp/bowl"
        show film bowl bowl.png --from 5 --step 5 \
            --eye 0.42,-0.76,0.63 --target 0,0,0.23 --width 0.84 --size 320x300 ;;
    fit)
        record fit "$examples/fit"
        show film fit fit.png --to 40 --step 2 --paint skeletons \
            --eye 1.0,-2.2,1.2 --target 0,0,0.42 --width 1.7 --size 360x290 ;;
    walk)
        record walk "$examples/cpp/walk"
        show film walk walk.png --from 60 --to 320 --step 8 \
            --eye 5.2,-2.2,2.4 --target 0,0.5,0.75 --width 5.0 --size 360x260 ;;
    character)
        record character "$examples/cpp/bullet_character"
        show film character character.png --from 0 --to 160 --step 5 \
            --eye 3.2,-5.2,2.9 --target 0.65,0,0.62 --width 4.3 --size 360x300 ;;
    *)
        echo "$1: unknown scene" >&2
        exit 1 ;;
    esac
}

[ $# -gt 0 ] || set -- collision clover skin muscle jelly dough bowl fit walk character
for name; do
    scene "$name"
done
du -sh "$gallery"
