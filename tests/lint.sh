#!/usr/bin/env bash
# What a reader should never have to check by eye: include directions, header guards, static
# analysis, shell and JSON syntax. Prints what to mend; exit status 1 where there is anything.
set -uo pipefail
cd "$(dirname "$0")/.."
failed=0
complain() { echo "lint: $*"; failed=1; }

# --- arrows point one way -----------------------------------------------------
# room: the rooms it may include from, itself among them. Public headers (groom/*.h) are named by
# the room that implements them.
declare -A allowed=(
    [lib/base]="base"
    [lib/geometry]="base geometry"
    [lib/strands]="base strands"
    [lib/model]="base geometry strands model"
    [lib/quality]="base geometry strands model quality"
    [lib/fit]="base geometry strands model quality fit"
    [lib/curvature]="base geometry strands model curvature"
    [lib/layers]="base geometry strands model curvature layers"
    [lib/retarget]="base geometry strands model retarget"
    [lib/sample]="base geometry strands model sample"
    [lib/render]="base geometry strands render"
)
declare -A room_of_header=(
    [status]=base [diag]=base [context]=base [random]=base [io]=base
    [mesh]=geometry [spatial]=geometry [scalp]=geometry [camera]=geometry
    [strands]=strands [format]=strands
    [groom]=model [document]=model [quality]=quality
    [fit]=fit [sample]=sample [render]=render [curvature]=curvature [layers]=layers [analysis]=curvature [retarget]=retarget
    [skeleton]=retarget [body]=retarget [correspondence]=retarget [hairline]=retarget
)

check_lib_include() { # file room included
    local target=$3
    case $target in
        groom/*.h) target=${target#groom/}; target=${target%.h}; target=${room_of_header[$target]:-?$target} ;;
        */*) target=${target%%/*} ;;
        *) complain "$1 includes \"$3\": name it from lib/ (\"room/file.h\")"; return ;;
    esac
    [[ " ${allowed[$2]} " == *" $target "* ]] || complain "$1 includes \"$3\": $2 may use only: ${allowed[$2]}"
}

check_includes() {
    local file room include top
    while IFS=: read -r file include; do
        top=${file%%/*}
        case $file in
            lib/include/*) [[ $include == groom/* ]] || complain "$file is public and includes \"$include\"" ;;
            lib/*) room=$(cut -d/ -f1,2 <<<"$file")
                   if [[ -z ${allowed[$room]:-} ]]; then complain "$room is a room that tests/lint.sh does not know"
                   else check_lib_include "$file" "$room" "$include"; fi ;;
            proto/*)  [[ $include == proto/* ]] || complain "$file includes \"$include\": proto stands alone" ;;
            server/*) [[ $include =~ ^(groom|proto|server)/ ]] || complain "$file includes \"$include\": server uses groom/, proto/ and server/" ;;
            # the client may use the public library: `groomctl sample` makes strands without a server
            client/*) [[ $include =~ ^(groom|proto|client)/ ]] || complain "$file includes \"$include\": client uses groom/, proto/ and client/" ;;
        esac
    done < <(grep -rnoE --include='*.[ch]' '^#include "[^"]+"' lib proto server client 2>/dev/null |
             sed -E 's/^([^:]+):[0-9]+:#include "([^"]+)"/\1:\2/')
}

# One interface before the database (server/store/store.h): nobody else knows which it is.
check_store() {
    grep -rnE --include='*.[ch]' 'sqlite|PRAGMA|server/store/database\.h|groomd\.db' server client lib proto | grep -v '^server/store/' &&
        complain "the store's own business is named above, outside of server/store"
}

check_guards() {
    local header
    while read -r header; do
        grep -q '^#ifndef' "$header" || complain "$header has no include guard"
    done < <(git ls-files '*.h')
}

check_scripts() {
    local script
    while read -r script; do bash -n "$script" || complain "$script does not parse"; done \
        < <(git ls-files '*.sh' '.ci/run')
    while read -r script; do node --check "$script" || complain "$script does not parse"; done \
        < <(git ls-files 'tests/*.mjs' 'client/*.mjs')
}

# Nothing in the project may name this or that machine.
check_words() {
    git grep -nIE '/work/(main|shared|wt)|/tmp/bash_jobs' -- . ':!tests/lint.sh' && complain "a path of one machine is named above"
}

# LINT_C names files where not all are meant; "none" skips this.
check_c() {
    [ "${LINT_C:-}" != none ] || return 0
    command -v cppcheck >/dev/null || { complain "cppcheck is missing: run deploy/setup.sh"; return; }
    # shellcheck disable=SC2086
    cppcheck --quiet --std=c11 --language=c --error-exitcode=1 --inline-suppr -j2 \
        --enable=warning,portability --suppress=missingIncludeSystem --suppress=internalAstError \
        -Ilib/include -Ilib -I. ${LINT_C:-lib proto server client/groomctl client/web} || complain "cppcheck: see above"
}

check_includes; check_store; check_guards; check_scripts; check_words; check_c
[ $failed -eq 0 ] && echo "lint: clean"
exit $failed
