#!/usr/bin/env bash
# Cost of each effect that no body carries: instructions per tick with its plugin installed and
# without, as a Markdown table. Runs of two lengths are subtracted, so that startup and exit of the
# program cancel. Requires valgrind. Fails if an effect costs more than 0.1 % of a tick.
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(cargo bench --quiet --no-default-features --bench absent -- path)
few=20
many=120

instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$@" 2>&1 |
        awk '/Collected/ { print $4 }'
}

per_tick() {
    local short long
    short=$(instructions "$1" $few "$2")
    long=$(instructions "$1" $many "$2")
    echo $(((long - short) / (many - few)))
}

echo "| effect | whole ticks, left out | installed | more | by the schedules, left out | installed | more |"
echo "|---|--:|--:|--:|--:|--:|--:|"
worst=0
for effect in ${*:-$("$program" list)}; do
    row="| \`$effect\` |"
    for how in "" scheduled; do
        without=$(per_tick "$effect" "${how:+$how-}left-out")
        with=$(per_tick "$effect" "${how:-installed}")
        row+=" $without | $with | $(awk "BEGIN { printf \"%+.4f %%\", 100 * ($with - $without) / $without }") |"
        awk "BEGIN { exit !(($with - $without) / $without > 0.001) }" && worst=1
    done
    echo "$row"
done
exit $worst
