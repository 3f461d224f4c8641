#!/usr/bin/env bash
# Makes a release: a folder with all that somebody without Rust needs, and nothing of this machine.
#
#     ./release.sh FOLDER
#
# weeder.hex          the firmware, for the page or avrdude to write
# firmware.txt        its size, and what it can need at most of stack and time
# page/               the page: open its index.html, or have `weeder serve` give it to a phone
# weeder              the host tools, for computers like this one
# manual/             README.md and all that it leads to
# licences/           what is inside, by whom and under which licence, with the licences' texts
# SHA256SUMS          of each of these files: `sha256sum --check SHA256SUMS`
#
# The same sources give the same weeder.hex and the same page, whatever machine or folder they are built in: .ci/from-nothing
# holds them against each other. `weeder` has its folders' names in it, and the system's libraries. FOLDER must not be there yet;
# it is there when all of it is.
set -euo pipefail

if [ $# -ne 1 ]; then
    echo "release.sh: say the folder to make, as in \`./release.sh weeder-release\`." >&2
    exit 1
fi
if [ -e "$1" ]; then
    echo "release.sh: $1 is there already. Remove it, or name another folder." >&2
    exit 1
fi
mkdir -p "$(dirname "$1")"
release=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
cd "$(dirname "$0")"
folder=$(mktemp -d "$release.XXXXXX")
trap 'rm -rf "$folder"' EXIT
chmod 755 "$folder"
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")

# The firmware, and what it needs.
cargo firmware --locked
elf=$target/avr-none/firmware/weeder-firmware.elf
avr-objcopy -O ihex -j .text -j .data "$elf" "$folder/weeder.hex"

# The host tools.
cargo build --locked --release --package weeder-cli
cp "$target/release/weeder" "$folder/"
{
    (cd "$(dirname "$elf")" && avr-size -A "$(basename "$elf")" | grep -E '^(section|\.(text|data|bss|noinit|eeprom) )')
    echo
    "$folder/weeder" bounds --elf "$elf"
} >"$folder/firmware.txt"

# The page.
[ -d page/node_modules ] || npm --prefix page ci --no-audit --no-fund
WEEDER_HEX="$folder/weeder.hex" npm --prefix page run build
cp -r page/dist "$folder/page"

# The manual, with its links as they are. Those to sources lead nowhere here.
mkdir "$folder/manual"
cp -r README.md CHANGELOG.md CONTRIBUTING.md docs "$folder/manual/"

# Licences. What runs only as it is built, and is not in what is built, is left out.
mkdir -p "$folder/licences/texts"
cp LICENSE-MIT LICENSE-APACHE "$folder/licences/"
list=$folder/licences/LICENCES.txt
cat >"$list" <<'END'
This project's own files are licensed under MIT or Apache-2.0, at your choice. What else is in this release stands below; texts/ has
each licence's text where its author gives one.

- weeder has simavr in it (https://github.com/buserror/simavr, by simavr-ffi), which is under GPL-3.0: so is `weeder` as a whole, and
  whoever passes it on has to offer all sources with it. libelf (LGPL-3.0 or GPL-2.0) is in it too.
- weeder.hex has code of avr-libc (modified BSD) and libgcc (GPL-3.0 with the GCC Runtime Library Exception) in it.
- The page has avr8js in it (MIT), and this project's firmware and Rust.

END
# Lines `NAME VERSION LICENCE` of the crates that a package of this repository is linked with.
crates() {
    cargo tree --locked --edges normal,no-proc-macro --no-dedupe --prefix none --format '{p}|{l}' "$@" |
        sed -e '/ (\//d' -e 's/ v\([0-9][^|]*\)|/ \1 /'
}
sources=(
    "weeder.hex|--package weeder-firmware --features avr --target avr-none"
    "page|--package page --target wasm32-unknown-unknown"
    "weeder|--package weeder-cli"
)
for source in "${sources[@]}"; do
    read -ra options <<<"${source#*|}"
    printf '%s:\n\n' "${source%%|*}"
    crates "${options[@]}" | LC_ALL=C sort -u | sed 's/^/    /'
    [ "${source%%|*}" != page ] || node --print 'const { name, version, license } = require("./page/node_modules/avr8js/package.json"); `    ${name} ${version} ${license}`'
    echo
done >>"$list"
for source in "${sources[@]}"; do
    read -ra options <<<"${source#*|}"
    crates "${options[@]}"
done | LC_ALL=C sort -u | while read -r name version _; do
    for crate in "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/"$name-$version"; do
        find "$crate" -maxdepth 3 -type f \( -iname 'LICEN[CS]E*' -o -iname 'COPYING*' -o -iname 'UNLICENSE*' \) |
            while read -r text; do
                place=${text#"$crate/"}
                install -D -m 644 "$text" "$folder/licences/texts/$name-$version/${place//\//-}"
            done
    done
done
install -D -m 644 page/node_modules/avr8js/LICENSE "$folder/licences/texts/avr8js/LICENSE"

(cd "$folder" && find . -type f ! -name SHA256SUMS -printf '%P\0' | LC_ALL=C sort -z | xargs -0 sha256sum >SHA256SUMS)
mv -T "$folder" "$release"
trap - EXIT
echo "The release is in $release."
