#!/usr/bin/env bash
# Renders every scene of the project, from whatever machine this is: installs what is
# missing, builds, renders, and says where the pictures are.
#
#   scripts/demo.sh                              640 pixels wide, 64 samples a pixel
#   scripts/demo.sh --width 1280 --spp 1024 …    with these options of `etendue render` instead
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/setup.sh
# A software driver must not look for a display.
unset DISPLAY WAYLAND_DISPLAY

(($# > 0)) || set -- --width 640 --spp 64
cargo build --release --locked
etendue="$CARGO_TARGET_DIR/release/etendue"

mkdir -p out
start=$SECONDS
pictures=()
for scene in scenes/*.gltf; do
    name="$(basename "$scene" .gltf)"
    echo "== $scene"
    "$etendue" render "$scene" -o "out/$name.exr" -o "out/$name.png" "$@"
    pictures+=("$PWD/out/$name.png")
done

echo
echo "${#pictures[@]} scenes rendered in $((SECONDS - start)) s. The pictures, each with a linear .exr beside it:"
printf '    %s\n' "${pictures[@]}"
