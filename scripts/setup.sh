#!/usr/bin/env bash
# Installs what etendue needs to build, render and pass its tests, and finds the
# environment that cargo needs. Does nothing where nothing is missing.
#
#   scripts/setup.sh    installs, then prints what a plain `cargo build` needs
#
# demo.sh and test.sh source it, which exports that; it ends the shell on failure.
#
# Debian 13: a base system suffices. Debian 12 and Ubuntu 24.04: their Rust is too
# old, so a rustup toolchain must be there. Without root the commands are printed.
set -euo pipefail

readonly RUST_VERSION=1.85 # rust-version in Cargo.toml
readonly MESA_VERSION=24.1 # the first lavapipe with ray queries
readonly CACHE="${XDG_CACHE_HOME:-$HOME/.cache}/etendue"

# g++ brings the linker and the C++ library that libshaderc needs; SPIRV-Tools are
# for the tests and for the static shaderc below, strace is for the tests.
readonly PACKAGES=(g++ ca-certificates libvulkan1 vulkan-validationlayers libshaderc-dev spirv-tools strace)

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$@"; exit 1; }

# $1 ≥ $2, both dotted numbers.
at_least() { [[ "$(printf '%s\n%s\n' "$2" "$1" | sort -V | head -n 1)" == "$2" ]]; }

# The folder of the first cargo that is new enough; some shells know rustup's only by its path.
find_cargo() {
    local folder version
    for folder in "$(dirname "$(command -v cargo || echo /)")" "${CARGO_HOME:-$HOME/.cargo}/bin" /usr/bin; do
        [[ -x "$folder/cargo" ]] || continue
        version="$("$folder/cargo" --version 2>/dev/null | cut -d' ' -f2)"
        if [[ -n "$version" ]] && at_least "$version" "$RUST_VERSION"; then
            echo "$folder"
            return
        fi
    done
    return 1
}

# Version of an installed package; empty when it is not installed.
installed() {
    dpkg-query --show --showformat '${db:Status-Status} ${Version}\n' "$1" 2>/dev/null | sed -n 's/^installed //p'
}

mesa_is_new() {
    local version
    version="$(installed mesa-vulkan-drivers)"
    [[ -n "$version" ]] && dpkg --compare-versions "$version" ge "$MESA_VERSION"
}

missing_packages() {
    local name
    for name in "${PACKAGES[@]}"; do
        [[ -n "$(installed "$name")" ]] || echo "$name"
    done
}

# Whether the distribution's own cargo would do. Unknown counts as yes: apt will tell.
cargo_package_is_new() {
    local candidate
    candidate="$(LC_ALL=C apt-cache policy cargo 2>/dev/null | sed -n 's/^ *Candidate: //p')"
    [[ -z "$candidate" || "$candidate" == "(none)" ]] || dpkg --compare-versions "$candidate" ge "$RUST_VERSION"
}

no_rust() {
    say "Rust $RUST_VERSION or newer is needed, and this system's package \`cargo\` is older."
    say "If you have rustup:  rustup update stable"
    die "Otherwise:  curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y"
}

# The commands that install what is missing, one a line.
plan() {
    local install="apt-get install --yes --no-install-recommends"
    local names
    names="$(missing_packages | tr '\n' ' ')"
    find_cargo >/dev/null || ! cargo_package_is_new || names+="cargo "
    if ! mesa_is_new; then
        if [[ "$(. /etc/os-release && echo "${VERSION_CODENAME:-}")" == bookworm ]]; then
            if ! grep -rqsE '^[^#]*bookworm-backports' /etc/apt/sources.list /etc/apt/sources.list.d; then
                echo "echo 'deb http://deb.debian.org/debian bookworm-backports main' > /etc/apt/sources.list.d/bookworm-backports.list"
                echo "apt-get update"
            fi
            echo "$install --target-release bookworm-backports mesa-vulkan-drivers"
        else
            names+="mesa-vulkan-drivers "
        fi
    fi
    [[ -z "$names" ]] || echo "$install ${names% }"
}

install_packages() {
    local commands command
    commands="$(plan)"
    if [[ -n "$commands" && "$(id -u)" != 0 ]]; then
        say "some packages are missing. Run as root, then start again:"
        printf '    %s\n' "apt-get update" "${commands//$'\n'/$'\n'    }" >&2
        find_cargo >/dev/null || cargo_package_is_new || no_rust
        exit 1
    fi
    find_cargo >/dev/null || cargo_package_is_new || no_rust
    [[ -n "$commands" ]] || return 0
    export DEBIAN_FRONTEND=noninteractive
    say "apt-get update"
    apt-get update >&2
    # Only now is it known which versions the package sources have.
    commands="$(plan)"
    find_cargo >/dev/null || cargo_package_is_new || no_rust
    while IFS= read -r command; do
        say "$command"
        bash -c "$command" >&2 </dev/null || die "failed: $command"
    done <<<"$commands"
    mesa_is_new || say "Mesa $(installed mesa-vulkan-drivers) is older than $MESA_VERSION: its lavapipe cannot trace rays in hardware queries; etendue's own BVH is used there."
}

# Without apt nothing can be installed here; say what is needed and check what can be checked.
check_tools() {
    say "no apt-get: this needs a C++ compiler, Rust $RUST_VERSION, the Vulkan loader and a driver (Mesa $MESA_VERSION has one without a GPU),"
    say "the Vulkan validation layers, libshaderc with its headers, and SPIRV-Tools."
    command -v cc >/dev/null || die "there is no C compiler (cc)"
    find_cargo >/dev/null || die "there is no cargo of version $RUST_VERSION or newer; see https://rustup.rs"
}

# Debian 12's libshaderc.so leaves out the glslang that it uses, so nothing links to it.
# The static archives of the same packages are whole once they are merged.
repair_shaderc() {
    [[ -z "${SHADERC_LIB_DIR:-}" ]] || return 0
    local shared folder name
    shared="$(cc -print-file-name=libshaderc.so)"
    # An unknown file is printed as it was asked for.
    [[ "$shared" == /* ]] || return 0
    grep -q 'undefined symbol' <<<"$(ldd -r "$shared" 2>&1)" || return 0
    folder="$(dirname "$shared")"
    if [[ ! "$CACHE/shaderc/libshaderc_combined.a" -nt "$folder/libshaderc_combined.a" ]]; then
        say "this system's libshaderc.so is incomplete: merging its static archives in $CACHE/shaderc"
        mkdir -p "$CACHE/shaderc"
        {
            echo "CREATE $CACHE/shaderc/merging.a"
            # glslang's split into archives differs between versions.
            for name in shaderc_combined glslang MachineIndependent GenericCodeGen OSDependent OGLCompiler SPIRV SPIRV-Tools-opt SPIRV-Tools; do
                [[ ! -e "$folder/lib$name.a" ]] || echo "ADDLIB $folder/lib$name.a"
            done
            echo SAVE
            echo END
        } | ar -M
        mv "$CACHE/shaderc/merging.a" "$CACHE/shaderc/libshaderc_combined.a"
    fi
    export SHADERC_LIB_DIR="$CACHE/shaderc"
}

# Cargo tells what two checkouts build in one folder apart by time alone: of the older one it would run what the newer one built.
make_anew_after_another_checkout() {
    local note="$CARGO_TARGET_DIR/checkout"
    if [[ -d "$CARGO_TARGET_DIR/release" && "$(cat "$note" 2>/dev/null)" != "$PWD" ]]; then
        say "what $CARGO_TARGET_DIR has of etendue is of another checkout: it is built anew"
        cargo clean --quiet --locked --release --package etendue
    fi
    mkdir -p "$CARGO_TARGET_DIR"
    printf '%s\n' "$PWD" >"$note"
}

if command -v apt-get >/dev/null; then install_packages; else check_tools; fi
cargo_folder="$(find_cargo)" || die "installed, but there is still no cargo of version $RUST_VERSION or newer"
path_hint=
if [[ "$(command -v cargo || true)" != "$cargo_folder/cargo" ]]; then
    path_hint="export PATH='$cargo_folder':\"\$PATH\""
    export PATH="$cargo_folder:$PATH"
fi
repair_shaderc

if [[ "${BASH_SOURCE[0]}" == "$0" ]]; then
    echo "Everything is there. For a plain \`cargo build --release\`:"
    [[ -z "${SHADERC_LIB_DIR:-}" ]] || echo "    export SHADERC_LIB_DIR='$SHADERC_LIB_DIR'"
    [[ -z "$path_hint" ]] || echo "    $path_hint"
    [[ -n "${SHADERC_LIB_DIR:-}$path_hint" ]] || echo "    nothing to export"
else
    # Outside the clone, so that a build never shows up in it.
    export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$CACHE/target}"
    make_anew_after_another_checkout
fi
