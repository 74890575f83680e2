#!/usr/bin/env bash
# Runs every benchmark, prints a table and writes $BUILD/bench.json.
# A benchmark is build/tests/bench/bench_* or tests/bench/*.mjs: it prints one line a figure,
#   figure NAME VALUE UNIT [words]
# and anything else is shown as it is.
set -uo pipefail
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
export BUILD
log=$BUILD/bench.log; : >"$log"
status=0
for program in "$BUILD"/tests/bench/bench_* tests/bench/*.mjs; do
    case $program in
        *.d|*.o) continue ;;
        *.mjs) [ -e "$program" ] || continue; node "$program" | tee -a "$log" || status=1 ;;
        *) [ -x "$program" ] || continue; "$program" | tee -a "$log" || status=1 ;;
    esac
done
awk 'BEGIN { printf "[" } /^figure / { printf "%s\n  {\"name\":\"%s\",\"value\":%s,\"unit\":\"%s\"}", n++ ? "," : "", $2, $3, $4 } END { print "\n]" }' \
    "$log" >"$BUILD/bench.json"
echo; echo "name                              value  unit"
awk '/^figure / { printf "%-28s %10s  %s\n", $2, $3, $4 }' "$log"
exit $status
