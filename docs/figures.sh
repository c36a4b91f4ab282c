#!/usr/bin/env bash
# Measures again what the README says fits into a frame, and prints its table: the median time of the
# solver in a tick of 1/60 s of some scenes, from their start to their end, on one thread and on two. Takes a
# minute on a quiet machine.
#
#   cargo build --release && docs/figures.sh [PROGRAM]
set -euo pipefail
program=${1:-${CARGO_TARGET_DIR:-target}/release/pliant}

# The median time of a tick [ms].
time_of() {
    # A scene that a short run does not bring to rest is not accepted, and timed all the same.
    { "$program" run "$1" --threads "$2" --seconds 4 --json || true; } |
        sed -n 's/^ *"ms_per_tick": \([0-9.eE+-]*\),*$/\1/p'
}
particles_of() {
    { "$program" run "$1" --seconds 0.02 --json || true; } | sed -n 's/^ *"particles": \([0-9]*\),*$/\1/p'
}

echo '| scene | particles | one thread | two |'
echo '|---|---:|---:|---:|'
while IFS='|' read -r scene what; do
    printf '| `%s`: %s | %s |' "$scene" "$what" "$(particles_of "$scene")"
    for threads in 1 2; do
        printf ' %.2g ms |' "$(time_of "$scene" "$threads")"
    done
    echo
done <<'SCENES'
bunny|a jelly filled with tetrahedra
flag|cloth in wind
hair|150 strands on a moving head
many_bodies|36 soft bodies on the ground
sand_pile|grains
pile|soft bodies that touch each other
tablecloth|cloth that folds over a block and onto itself
all_together|jelly, cloth, balloon, rope, hair and grains in a box, in contact
SCENES
