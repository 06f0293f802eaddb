#!/bin/sh
# Runs programs, as many at once as there are cores: run_each.sh 'COMMAND IN FRONT' PROGRAM ...
# What one prints is shown when it has ended. Fails if one fails, or takes longer than five minutes.
set -u
front=$1
shift
[ $# -gt 0 ] || { echo 'no program found for this stage'; exit 1; }
# A program that hangs must not hang the run.
command -v timeout >/dev/null && front="timeout 300 $front"
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
printf '%s\n' "$@" | FRONT=$front LOGS=$logs xargs -P "$(getconf _NPROCESSORS_ONLN)" -I '{}' sh -c '
	program={} name=$(basename {}) log=$LOGS/$(echo {} | tr / _)
	$FRONT "$program" >"$log" 2>&1
	status=$?
	{
		echo "-- $name"
		cat "$log"
		[ $status = 0 ] || echo "$program failed: exit code $status$([ $status != 124 ] || echo ", too slow")"
	} >"$log.whole"
	cat "$log.whole"
	[ $status = 0 ]
' || exit 1
echo "$# program(s) passed"
