#!/bin/sh
# Installs the Debian packages of deploy/packages.txt that are missing, and Node.js for the tests.
#   deploy/setup.sh [LIST]    another list of this folder
# Says what it installs; asks for sudo where it is not root; does nothing on a machine that has all.
set -eu
here=$(cd "$(dirname "$0")" && pwd)

installed() { dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q '^install ok installed$'; }

missing=
for package in $(sed 's/#.*//' "$here/${1:-packages.txt}"); do
    installed "$package" || missing="$missing $package"
done

# Node.js 18 or newer from anywhere will do; Debian's where there is none.
node_major=$(node --version 2>/dev/null | sed 's/^v\([0-9]*\).*/\1/')
[ "${node_major:-0}" -ge 18 ] || missing="$missing nodejs"
command -v npm >/dev/null 2>&1 || missing="$missing npm"

[ -n "$missing" ] || exit 0

as_root=
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null 2>&1 || { echo "setup: run this as root, or install sudo, to add:$missing" >&2; exit 1; }
    as_root=sudo
fi
echo "setup: installing Debian packages:$missing"
export DEBIAN_FRONTEND=noninteractive
# what is installed for a test is not started as a service
export RUNLEVEL=1
$as_root apt-get update -q
# shellcheck disable=SC2086
$as_root apt-get install -q -y --no-install-recommends $missing
