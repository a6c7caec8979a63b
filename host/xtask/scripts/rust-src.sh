#!/usr/bin/env bash
# rust-src.sh DEST: gives the pinned toolchain the source of its own standard library, so that -Zbuild-std works where
# rustup cannot download. DEST/rustc is then the compiler to use, with RUSTC_BOOTSTRAP=1.
#
# The source is Debian's rust-src package of the very same version, taken through a private apt root: about 45 MB, nothing
# is installed and no system file changes. Fails if the version is in no suite below.
set -euo pipefail

dest=$(realpath -m "$1")
version=$(rustc --version | cut -d' ' -f2)
sysroot=$(rustc --print sysroot)
[ -x "$dest/rustc" ] && [ "$(cat "$dest/version" 2>/dev/null)" = "$version $sysroot" ] && exit 0

rm -rf "$dest"
apt=$dest/apt
mkdir -p "$apt/state/lists/partial" "$apt/cache/archives/partial" "$apt/etc" "$dest/deb" "$dest/sysroot/lib/rustlib/src"
touch "$apt/state/status"

# The mirror the machine already uses; security mirrors carry no backports.
mirror=$(cat /etc/apt/sources.list.d/*.sources /etc/apt/sources.list.d/*.list /etc/apt/sources.list 2>/dev/null |
    grep -Eo 'https?://[^] ]+/debian/?( |$)' | head -n 1 | tr -d ' ' || true)
mirror=${mirror:-http://deb.debian.org/debian}
for suite in trixie-backports trixie forky sid; do
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror $suite main"
done > "$apt/etc/all"

options=(-o Dir::Etc::sourcelist="$apt/etc/sources.list" -o Dir::Etc::sourceparts=/dev/null -o Dir::State="$apt/state"
    -o Dir::State::status="$apt/state/status" -o Dir::Cache="$apt/cache" -o APT::Sandbox::User=root
    -o Acquire::Retries=3 -o Acquire::Languages=none)
package=
while read -r line; do
    echo "$line" > "$apt/etc/sources.list"
    apt-get -qq "${options[@]}" update || continue
    package=$(apt-cache "${options[@]}" madison rust-src | awk -v v="$version" 'index($3, v "+") == 1 || index($3, v "-") == 1 {print $3; exit}')
    [ -n "$package" ] && break
done < "$apt/etc/all"
[ -n "$package" ] || { echo "rust-src.sh: no suite of $mirror has rust-src $version" >&2; exit 1; }

(cd "$dest/deb" && apt-get -qq "${options[@]}" download "rust-src=$package" && dpkg -x rust-src_*.deb . && rm ./*.deb)
source=$(echo "$dest"/deb/usr/src/rustc-*)
[ -d "$source/library/core" ] || { echo "rust-src.sh: $source holds no library" >&2; exit 1; }

# A sysroot like the toolchain's, with the source where cargo looks for it.
for entry in "$sysroot"/bin "$sysroot"/libexec; do
    [ -e "$entry" ] && ln -sfn "$entry" "$dest/sysroot/$(basename "$entry")"
done
for entry in "$sysroot"/lib/*; do
    [ "$(basename "$entry")" = rustlib ] || ln -sfn "$entry" "$dest/sysroot/lib/$(basename "$entry")"
done
for entry in "$sysroot"/lib/rustlib/*; do
    [ "$(basename "$entry")" = src ] || ln -sfn "$entry" "$dest/sysroot/lib/rustlib/$(basename "$entry")"
done
ln -sfn "$source" "$dest/sysroot/lib/rustlib/src/rust"
printf '#!/bin/sh\nexec "%s/bin/rustc" --sysroot "%s/sysroot" "$@"\n' "$sysroot" "$dest" > "$dest/rustc"
chmod +x "$dest/rustc"
rm -rf "$apt"
echo "$version $sysroot" > "$dest/version"
