#!/usr/bin/env bash
# Makes groomd_VERSION_ARCH.deb of the programs in $BUILD.
#   deploy/debian/build.sh [FOLDER]     where to put it ($BUILD)
set -euo pipefail
cd "$(dirname "$0")/../.."
BUILD=${BUILD:-build}
out=${1:-$BUILD}
revision=$(git rev-list --count HEAD 2>/dev/null || echo 0)
version=${GROOMD_VERSION:-1.0~r$revision}
arch=$(dpkg --print-architecture)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root

install -d "$root/DEBIAN" "$root/usr/share/doc/groomd/examples" "$root/usr/share/groomd"
install -Dm 755 -s -t "$root/usr/bin" "$BUILD/groomd" "$BUILD/groom-worker" "$BUILD/groomctl"
install -Dm 644 deploy/groomd.conf "$root/etc/groomd/groomd.conf"
install -Dm 644 deploy/systemd/groomd.service "$root/lib/systemd/system/groomd.service"
install -Dm 644 deploy/systemd/groomd.sysusers "$root/usr/lib/sysusers.d/groomd.conf"
install -m 644 proto/openapi.yaml "$root/usr/share/groomd/openapi.yaml"
install -m 644 deploy/nginx/groomd.conf "$root/usr/share/doc/groomd/examples/nginx.conf"
install -m 644 deploy/README.md "$root/usr/share/doc/groomd/README.md"
{
    printf 'Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: groomd\n\n'
    printf 'Files: *\nCopyright: 2026 the authors of groomd\nLicense: Apache-2.0\n'
    printf ' On Debian systems the text of the licence is in /usr/share/common-licenses/Apache-2.0.\n'
} >"$root/usr/share/doc/groomd/copyright"
printf 'groomd (%s) unstable; urgency=medium\n\n  * Built from the sources at revision %s.\n\n -- groomd <maintainers@groomd.example>  %s\n' \
    "$version" "$revision" "$(date -R -d "@$(git log -1 --format=%ct 2>/dev/null || echo 0)")" |
    gzip -9n >"$root/usr/share/doc/groomd/changelog.gz"
echo /etc/groomd/groomd.conf >"$root/DEBIAN/conffiles"
for script in postinst prerm postrm; do install -m 755 "deploy/debian/$script" "$root/DEBIAN/$script"; done

# what the programs are linked to says what the package depends on
mkdir -p "$work/debian"
printf 'Source: groomd\n\nPackage: groomd\nArchitecture: any\n' >"$work/debian/control"
depends=$(cd "$work" && dpkg-shlibdeps -O "$root/usr/bin/groomd" "$root/usr/bin/groom-worker" "$root/usr/bin/groomctl" 2>/dev/null |
          sed 's/^shlibs:Depends=//')
cat >"$root/DEBIAN/control" <<CONTROL
Package: groomd
Version: $version
Architecture: $arch
Maintainer: groomd <maintainers@groomd.example>
Section: graphics
Priority: optional
Installed-Size: $(du -sk --exclude=DEBIAN "$root" | cut -f1)
Depends: $depends
Recommends: nginx | httpd
Suggests: slurm-client
Description: hair strands into procedural grooms
 groomd is a service: dense hair strands are uploaded over HTTP and fitted with
 a few hundred guides and a chain of operators (scale, bend, curl, clump, frizz).
 .
 This package has the daemon, its worker and the command-line client groomctl.
CONTROL
mkdir -p "$out"
dpkg-deb --root-owner-group --build "$root" "$out/groomd_${version}_${arch}.deb" >/dev/null
echo "$out/groomd_${version}_${arch}.deb"
