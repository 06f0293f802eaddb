#!/bin/sh
# Runs the targets test-<stage> one after the other: `stages.sh MAKE STAGE...`. Prints one line a stage with its time,
# keeps the output of each in $LOGS, and stops at the first failure with the output of that stage. With V=1 in the
# environment the output is shown while it comes.
set -u
make=$1
shift
# What a stage builds, it builds side by side.
jobs=-j$(getconf _NPROCESSORS_ONLN)
mkdir -p "$LOGS"

# What a stage says of itself: the sum of cargo's test results, or its last line.
verdict() {
    awk '/^test result: ok/ { tests += $4; ignored += $8 }
         NF { last = $0; sub(/^ +/, "", last) }
         END { if (tests) printf "%d tests passed, %d ignored", tests, ignored; else print substr(last, 1, 70) }' "$1"
}

start=$(date +%s)
for stage in "$@"; do
    log=$LOGS/$stage.log
    begin=$(date +%s)
    printf '%-10s ' "$stage"
    if [ -n "${V:-}" ]; then
        echo
        { "$make" "$jobs" "test-$stage" 2>&1; echo $? >"$log.status"; } | tee "$log"
        status=$(cat "$log.status")
        rm -f "$log.status"
    else
        "$make" "$jobs" "test-$stage" >"$log" 2>&1
        status=$?
    fi
    took=$(($(date +%s) - begin))
    if [ "$status" -ne 0 ]; then
        printf 'FAILED %4d s\n\n' "$took"
        [ -n "${V:-}" ] || tail -n 200 "$log"
        printf '\nStage "%s" failed. Again, alone: make test-%s. Whole output: %s\n' "$stage" "$stage" "$log" >&2
        exit 1
    fi
    printf 'ok     %4d s   %s\n' "$took" "$(verdict "$log")"
done
took=$(($(date +%s) - start))
printf '\nAll %d stages passed in %d min %02d s.\n' $# $((took / 60)) $((took % 60))
# For those who count.
printf 'stages: %d passed, 0 failed\n' $#
