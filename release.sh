#!/usr/bin/env bash
# Makes a release: a folder for users without Rust, independent of the build machine. Runs on Debian and Ubuntu.
#
#     ./release.sh FOLDER             for computers like this one
#     ./release.sh FOLDER SYSTEM      for x86_64-pc-windows-gnu or aarch64-unknown-linux-gnu; `./setup.sh page cross` installs
#                                     the compilers
#
# START.html          where to begin, in the page's languages
# weeder.hex          the firmware, for the page or avrdude to write
# weeder-tester.hex   the firmware of a second Uno, which checks the first
# firmware.txt        its size, and its worst-case stack and time
# page/               the page: open its index.html, or serve it to a phone with `weeder serve`
# weeder              the host tools, with the firmware and the page inside; on Windows weeder.exe
# wokwi/              the wiring with this firmware, for the Wokwi editor
# 60-weeder.rules     lets a Linux user open an Uno's port; not for Windows
# manual/             README.md and docs/, as Markdown, and the sources that docs/ links; book/ is docs/ for a browser
# sbom/               the parts as CycloneDX, for programs: packages, versions, licences
# licences/           the parts, their authors and licences, with the licences' texts
# SHA256SUMS          of each of these files: `sha256sum --check SHA256SUMS`
#
# Tools and firmware name their commit, with a `+` if the sources differ from it. Outside of a clone they name none.
#
# The same sources give the same weeder.hex, page and sbom on each machine and in each folder: .ci/from-nothing compares them.
# `weeder` contains the names of its folders, and the system's libraries. FOLDER must not exist; it appears when the release is
# complete.
set -euo pipefail
# Names are sorted, and letters change their case, alike on each machine.
export LC_ALL=C

if [ $# -ne 1 ] && [ $# -ne 2 ]; then
    echo "release.sh: name the new folder, as in \`./release.sh weeder-release\`, and a system if it is another than this one." >&2
    exit 1
fi
here=$(rustc --print host-tuple)
system=${2:-$here}
# The system's name for a reader, the name of its GNU tools, and how its programs end.
case "$system" in
    "$here") title="$(uname -s) on $(uname -m)" gnu='' exe='' ;;
    x86_64-pc-windows-gnu) title="Windows on x86_64" gnu=x86_64-w64-mingw32 exe=.exe ;;
    aarch64-unknown-linux-gnu) title="Linux on aarch64" gnu=aarch64-linux-gnu exe='' ;;
    *)
        echo "release.sh: there is no release for $system. Use x86_64-pc-windows-gnu or aarch64-unknown-linux-gnu." >&2
        exit 1
        ;;
esac
if [ -e "$1" ]; then
    echo "release.sh: $1 exists. Remove it, or name another folder." >&2
    exit 1
fi
# GNU tools and Debian's folders are used below.
optiboot=/usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot/optiboot.c
if [ ! -e "$optiboot" ]; then
    echo "release.sh: there is no $optiboot. Use Debian or Ubuntu, and run ./setup.sh page first." >&2
    exit 1
fi
mkdir -p "$(dirname "$1")"
release=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
cd "$(dirname "$0")"
folder=$(mktemp -d "$release.XXXXXX")
trap 'rm -rf "$folder"' EXIT
# As in setup.sh.
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export CARGO_TARGET_DIR=$target
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS CARGO_BUILD_TARGET CARGO_INCREMENTAL

# The host tools for another system. simavr's makefile and its Rust binding know only this computer, so their settings come from the
# environment. simavr's reader of ELF files is left out, because the virtual Uno has its own: the libraries that it needs are empty.
build_for_another() {
    local empty=$target/empty-libraries name library
    rm -rf "$empty"
    mkdir -p "$empty"
    for name in libelf zlib libzstd; do
        printf 'Name: %s\nDescription: empty\nVersion: 0\nLibs: -L"%s"\n' "$name" "$empty" >"$empty/$name.pc"
    done
    for library in elf z; do "$gnu-ar" rcs "$empty/lib$library.a"; done
    local linker=CARGO_TARGET_${system^^}_LINKER libraries=''
    [ -z "$exe" ] || libraries=-lws2_32
    env CC="$gnu-gcc" AR="$gnu-ar" RANLIB="$gnu-ranlib" LDFLAGS="$libraries" C_LIBELF='' LD_LIBELF='' C_LIBDWARF='' LD_LIBDWARF='' \
        PKG_CONFIG_ALLOW_CROSS=1 PKG_CONFIG_LIBDIR="$empty" \
        "BINDGEN_EXTRA_CLANG_ARGS_${system//-/_}=-isystem /usr/$gnu/include" \
        "${linker//-/_}=$gnu-gcc" cargo build --locked --release --package weeder-cli --target "$system"
}

# The host tools of this computer, which build the rest, without firmware and page inside: those that WEEDER names, or new ones.
weeder=${WEEDER:-}
if [ -z "$weeder" ]; then
    cargo build --locked --release --package weeder-cli
    weeder=$target/release-weeder
    cp "$target/release/weeder" "$weeder"
fi
WEEDER_COMMIT=$("$weeder" --version | sed -n 's/.*(\(.*\))$/\1/p')
export WEEDER_COMMIT

# The firmware. `weeder hex` proves its bounds before it writes the file.
cargo firmware --locked
elf=$target/avr-none/firmware/weeder-firmware.elf
"$weeder" hex --elf "$elf" "$folder/weeder.hex"
{
    (cd "$(dirname "$elf")" && avr-size -A "$(basename "$elf")" | grep -E '^(section|\.(text|data|bss|noinit|eeprom) )')
    echo
    "$weeder" bounds --elf "$elf"
} >"$folder/firmware.txt"

# The tester's firmware.
"$weeder" hex --tester "$folder/weeder-tester.hex"

# What the host tools have inside: the firmware of each chip with its budgets, the Uno's bootloader for the virtual Uno, and the page.
cargo bench-firmware --locked
cargo tester-firmware --locked
inside=$target/release-inside
rm -rf "$inside"
mkdir -p "$inside/yard/tester"
for name in weeder-firmware knn-bench tester-firmware; do
    avr-objcopy --strip-debug "$(dirname "$elf")/$name.elf" "$inside/$name.elf"
done
cp budgets.toml "$inside/"
cp yard/tester/budgets.toml "$inside/yard/tester/"
# As in yard/virtual-uno/src/bootloader.rs.
avr-gcc -mmcu=atmega328p -DF_CPU=16000000L -DBAUD_RATE=115200 -w -Os -mrelax -nostdlib -fno-split-wide-types \
    -fno-inline-small-functions -nostartfiles -Wl,--section-start=.text=0x7e00 -o "$inside/optiboot.elf" "$optiboot"
avr-objcopy -O ihex -j .text "$inside/optiboot.elf" "$inside/optiboot.hex"
"$weeder" hex --elf "$inside/weeder-firmware.elf" "$inside/weeder.hex"
cmp "$inside/weeder.hex" "$folder/weeder.hex"

# The page. Its packages are installed as in setup.sh.
lock=page/node_modules/.package-lock.json
if [ ! -e "$lock" ] || [ page/package-lock.json -nt "$lock" ]; then npm --prefix page ci --no-audit --no-fund; fi
WEEDER="$weeder" npm --prefix page run build
cp -r page/dist "$folder/page"
cp -r page/dist "$inside/page"

# The host tools of the release. They name their commit by themselves.
unset WEEDER_COMMIT
export WEEDER_INSIDE="$inside"
if [ "$system" = "$here" ]; then
    cargo build --locked --release --package weeder-cli
    cp "$target/release/weeder" "$folder/"
    "$folder/weeder" hex --force "$inside/weeder.hex"
    cmp "$inside/weeder.hex" "$folder/weeder.hex"
else
    build_for_another
    cp "$target/$system/release/weeder$exe" "$folder/"
fi
unset WEEDER_INSIDE

# The front door, with the part for this system. On Linux, the rule.
if [ -n "$exe" ]; then
    other=linux
else
    other=windows
    cp host/cli/60-weeder.rules "$folder/"
fi
sed -e "s|SYSTEM|$title|" -e "/<!-- $other -->/,/<!-- end -->/d" -e '/<!--.*-->/d' page/START.html >"$folder/START.html"
mkdir "$folder/wokwi"
cp wokwi/diagram.json "$folder/wokwi/"
cp "$inside/weeder-firmware.elf" "$folder/wokwi/weeder.elf"
sed -e '/^#/d' -e 's|^firmware = .*|firmware = "../weeder.hex"|' -e 's|^elf = .*|elf = "weeder.elf"|' wokwi/wokwi.toml >"$folder/wokwi/wokwi.toml"

# The manual, with the sources that docs/ links. Other links to sources do not work here.
mkdir "$folder/manual"
cp -r README.md CHANGELOG.md CONTRIBUTING.md CITATION.cff LICENSE-MIT LICENSE-APACHE docs "$folder/manual/"
cp --parents yard/avr-bounds/README.md "$folder/manual/"
grep -oh '](\.\./[^)#]*' docs/*.md | sed 's|^](\.\./||' | sort -u | xargs cp --parents --target-directory="$folder/manual"
cargo install --quiet --locked mdbook --version 0.5.4 --no-default-features --features search --root "$target/mdbook"
"$target/mdbook/bin/mdbook" build --dest-dir "$folder/book"
# mdBook has made .html of the linked .md, which are outside of the book.
sed -i -e 's|href="\.\./|href="../manual/|g' -e 's|\(href="\.\./manual/[^"#]*\)\.html|\1.md|g' "$folder"/book/*.html
node .ci/links.mjs "$folder"

# Licences. Tools that only run during the build are left out.
mkdir -p "$folder/licences/texts"
cp LICENSE-MIT LICENSE-APACHE "$folder/licences/"
list=$folder/licences/LICENCES.txt
cat >"$list" <<'END'
This project's own files are licensed under MIT or Apache-2.0, at your choice. What else is in this release stands below; texts/ has
each licence's text where its author gives one.

- weeder has simavr in it (https://github.com/buserror/simavr, by simavr-ffi), which is under GPL-3.0: so is `weeder` as a whole, and
  distributors have to offer all sources with it.
- weeder has Optiboot in it (https://github.com/Optiboot/optiboot, from arduino-core-avr), for the virtual Uno: GPL-2.0.
- weeder.hex and weeder-tester.hex have code of avr-libc (modified BSD) and libgcc (GPL-3.0 with the GCC Runtime Library Exception) in them.
- The page has avr8js in it (MIT), and this project's firmware and Rust.
- book/ has mdBook's theme in it (MPL-2.0), with highlight.js (BSD-3-Clause) and fonts (OFL-1.1).
END
[ "$system" != "$here" ] || echo "- weeder has libelf in it (LGPL-3.0 or GPL-2.0)." >>"$list"
echo >>"$list"
# Lines `NAME VERSION LICENCE` of the crates that a package of this repository links.
crates() {
    cargo tree --locked --edges normal,no-proc-macro --no-dedupe --prefix none --format '{p}|{l}' "$@" |
        sed -e '/ (\//d' -e 's/ v\([0-9][^|]*\)|/ \1 /'
}
sources=(
    "weeder.hex|--package weeder-firmware --features avr --target avr-none"
    "weeder-tester.hex|--package tester-firmware --features avr --target avr-none"
    "page|--package page --target wasm32-unknown-unknown"
    "weeder|--package weeder-cli --target $system"
)
for source in "${sources[@]}"; do
    read -ra options <<<"${source#*|}"
    printf '%s:\n\n' "${source%%|*}"
    crates "${options[@]}" | sort -u | sed 's/^/    /'
    [ "${source%%|*}" != page ] || node --print 'const { name, version, license } = require("./page/node_modules/avr8js/package.json"); `    ${name} ${version} ${license}`'
    echo
done >>"$list"
for source in "${sources[@]}"; do
    read -ra options <<<"${source#*|}"
    crates "${options[@]}"
done | sort -u | while read -r name version _; do
    for crate in "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/"$name-$version"; do
        find "$crate" -maxdepth 3 -type f \( -iname 'LICEN[CS]E*' -o -iname 'COPYING*' -o -iname 'UNLICENSE*' \) |
            while read -r text; do
                place=${text#"$crate/"}
                install -D -m 644 "$text" "$folder/licences/texts/$name-$version/${place//\//-}"
            done
    done
done
install -D -m 644 page/node_modules/avr8js/LICENSE "$folder/licences/texts/avr8js/LICENSE"

# SBOMs. cargo-cyclonedx writes one beside each Cargo.toml of the workspace. Parts that differ between runs and folders are removed,
# and linked C code is added. simavr-ffi contains simavr without a version of its own.
c_avr_libc="avr-libc|$(printf '#include <avr/version.h>\n__AVR_LIBC_VERSION_STRING__' | avr-gcc -E -P - | tail -1 | tr -d '"')|BSD-3-Clause"
c_libgcc="libgcc|$(avr-gcc -dumpversion)|GPL-3.0-or-later WITH GCC-exception-3.1"
c_simavr="simavr|in simavr-ffi $(sed -n '/^name = "simavr-ffi"$/{n;s/.*"\(.*\)"/\1/p}' Cargo.lock)|GPL-3.0-or-later"
c_libelf="libelf|$(pkg-config --modversion libelf)|GPL-2.0-or-later OR LGPL-3.0-or-later"
cargo install --quiet --locked --root "$target/tools" --version 0.5.9 cargo-cyclonedx
mkdir "$folder/sbom"
# Arguments: the SBOM's name, its package's folder, parts to add up to `--`, and options.
sbom() {
    local name=$1 package=$2 c=()
    shift 2
    while [ "$1" != -- ]; do
        c+=("$1")
        shift
    done
    shift
    SOURCE_DATE_EPOCH=0 "$target/tools/bin/cargo-cyclonedx" cyclonedx --quiet --format json --no-build-deps --override-filename sbom "$@"
    node .ci/sbom.mjs "$package/sbom.json" "$folder/sbom/$name.json" "${c[@]}"
    find . -name target -prune -o -name node_modules -prune -o -name sbom.json -exec rm {} +
}
sbom firmware . "$c_avr_libc" "$c_libgcc" -- --features avr --target avr-none
sbom tester yard/tester "$c_avr_libc" "$c_libgcc" -- --features avr --target avr-none
c_of_weeder=("$c_simavr")
[ "$system" != "$here" ] || c_of_weeder+=("$c_libelf")
sbom weeder host/cli "${c_of_weeder[@]}" -- --target "$system"
sbom page host/page -- --target wasm32-unknown-unknown
(cd page && npx --yes npm@10.9.4 sbom --sbom-format cyclonedx --omit dev) >"$target/npm-sbom.json"
node .ci/sbom.mjs "$target/npm-sbom.json" "$folder/sbom/page-npm.json"

(cd "$folder" && find . -type f ! -name SHA256SUMS -printf '%P\0' | sort -z | xargs -0 sha256sum >SHA256SUMS)
# Every user may read it, under any umask.
chmod -R u=rwX,go=rX "$folder"
mv -T "$folder" "$release"
trap - EXIT
echo "The release is in $release."
