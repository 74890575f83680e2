#!/usr/bin/env bash
# Runs the tests and closes with one line: N passed, N failed, N skipped.
#   tests/run.sh [unit|api|e2e|cluster|deploy ...]     unit, api and e2e where none is named; api/NAME: one file. BUILD is the build folder.
set -uo pipefail
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build}
export BUILD
kinds=("$@"); [ ${#kinds[@]} -gt 0 ] || kinds=(unit api e2e faults)
mkdir -p "$BUILD/tests"
log=$BUILD/tests/last.log; : >"$log"
failed_programs=()

run() { # name command...
    local name=$1; shift
    "$@" 2>&1 | tee -a "$log" | sed "s|^|$name: |"
    [ "${PIPESTATUS[0]}" -eq 0 ] || failed_programs+=("$name")
}

# Under ThreadSanitizer everything takes 10 to 20 times as long. What fits again and again on one thread, and therefore
# has nothing for it to see, is left out: of these suites those tests stay that are about threads. test_fit_property's fits
# are whole ones, as is that of test_fit on three threads.
named_tests() { # program
    [ "${VARIANT:-}" = tsan ] || return 0
    case $1 in test_fit_operators|test_fit_randoms|test_fit_paper) echo threads ;; esac
}
too_slow() { # program
    [ "${VARIANT:-}" = tsan ] && [ "$1" = test_fit_property ] || return 1
    echo "SKIPPED: $1 under ThreadSanitizer: whole fits, of which test_fit has one on three threads" | tee -a "$log"
}

run_unit() {
    local program corpus named
    for program in "$BUILD"/tests/unit/test_* "$BUILD"/tests/property/test_*; do
        case $program in *.d|*.o) continue ;; esac
        [ -x "$program" ] && ! too_slow "${program##*/}" || continue
        named=$(named_tests "${program##*/}")
        run "${program##*/}" env ${named:+TESTS_NAMED=$named} ${VARIANT:+CK_TIMEOUT_MULTIPLIER=8 timeout "${SUITE_SECONDS:-2400}"} "$program"
    done
    for program in "$BUILD"/tests/fuzz/replay_*; do
        corpus=tests/fuzz/corpus/${program##*/replay_}
        [ -x "$program" ] && [ -d "$corpus" ] && run "${program##*/}" "$program" "$corpus"/*
    done
}

run_node() { # folder
    local files=(tests/"$1"/*.test.mjs)
    [ -e "${files[0]}" ] || return 0
    # one file after another: each starts a daemon of its own, and the machine has two cores
    local file
    for file in "${files[@]}"; do run "$1/${file##*/}" node --test --test-reporter=tap "$file"; done
}

for kind in "${kinds[@]}"; do
    case $kind in
        unit) run_unit ;;
        api|e2e|faults|cluster|deploy) run_node "$kind" ;;
        api/*|e2e/*) run "$kind" node --test --test-reporter=tap "tests/$kind.test.mjs" ;;
        *) echo "tests/run.sh: unit, api, e2e, faults, cluster or deploy, not $kind" >&2; exit 2 ;;
    esac
done

# Check prints "Checks: 7, Failures: 0, Errors: 0"; node's TAP reporter "# pass 7" and "# fail 0".
read -r passed failed skipped < <(awk '
    /Checks: [0-9]+, Failures: [0-9]+, Errors: [0-9]+/ {
        match($0, /Checks: [0-9]+/);   c = substr($0, RSTART + 8, RLENGTH - 8)
        match($0, /Failures: [0-9]+/); f = substr($0, RSTART + 10, RLENGTH - 10)
        match($0, /Errors: [0-9]+/);   e = substr($0, RSTART + 8, RLENGTH - 8)
        p += c - f - e; b += f + e }
    /^# pass /    { p += $3 }
    /^# fail /    { b += $3 }
    /^# skipped / { s += $3 }
    /^SKIPPED: /  { s++ }
    END { print p + 0, b + 0, s + 0 }' "$log")
grep -h '^SKIPPED: ' "$log" | sort | uniq -c
# What went wrong, once more and together: of a long log often its end alone is seen. Check's lines say "file:line:F:"; after
# node's "not ok" comes a block with the error, whose text may begin on the next line.
if [ ${#failed_programs[@]} -gt 0 ]; then
    awk '/:[0-9]+:[FE]:/ { print; next }
         /^ *not ok / { print; looks = 1; next }
         looks && /^ *error:/ { print; taken = /[|>]-$/ ? 4 : 0; looks = 0; next }
         taken > 0 { print; taken-- }
         /^ *ok / { looks = taken = 0 }' "$log"
    echo "failed: ${failed_programs[*]}"
    [ "$failed" -gt 0 ] || failed=${#failed_programs[@]}
fi
echo "tests: $passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ] && [ ${#failed_programs[@]} -eq 0 ]
