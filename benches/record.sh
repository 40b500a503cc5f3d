#!/usr/bin/env bash
# Runs the benchmarks and records their medians: benches/record/<date>-<machine>.csv.
#
#     benches/record.sh [FILTER]     FILTER is a regular expression for benchmark names
#
# Lines that benchmarks print in addition to criterion's (ratios, peak memory) are kept as comments.
# Run nothing else on the machine meanwhile.
set -euo pipefail
cd "$(dirname "$0")/.."

cpu=$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | head -n 1)
cores=$(getconf _NPROCESSORS_ONLN)
machine=$(echo "${cpu:-$(uname -m)}-$cores-cores" | tr -cs '[:alnum:]\n' '-' | tr '[:upper:]' '[:lower:]')
record="benches/record/$(date +%F)-$machine.csv"
output=$(mktemp)
started=$(mktemp)
trap 'rm -f "$output" "$started"' EXIT

cargo bench -p foliage-lod --features render,simplify -- "$@" | tee "$output"

{
    version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
    echo "# date: $(date +%F), foliage-lod $version, $(rustc --version)"
    echo "# machine: ${cpu:-$(uname -m)}, $cores cores, $(uname -sr)"
    grep -E '^[^ ].*(, ratio |per frame|per leaf|per lookup|per changed|in view| times the |llvmpipe)' "$output" | sed 's/^/# /' || true
    echo "benchmark,median_ns,low_ns,high_ns"
    find target/criterion -path '*/new/estimates.json' -newer "$started" | sort | while read -r estimates; do
        name=$(sed -n 's/.*"full_id":"\([^"]*\)".*/\1/p' "$(dirname "$estimates")/benchmark.json")
        # Confidence interval and point estimate of the median.
        numbers=$(sed -n 's/.*"median":{"confidence_interval":{"confidence_level":[^,]*,"lower_bound":\([^,]*\),"upper_bound":\([^}]*\)},"point_estimate":\([^,]*\),.*/\3,\1,\2/p' \
            "$estimates" | sed 's/\(\.[0-9]\)[0-9]*/\1/g')
        echo "\"$name\",$numbers"
    done
} > "$record"
echo "recorded in $record"
