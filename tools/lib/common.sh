# Shared by the scripts in tools/. Sourced, never run.
# shellcheck shell=bash

# Where the checkout is; every script may be called from any folder.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

# Put before ctest by run_ctest, e.g. (setarch --addr-no-randomize).
ctest_wrapper=()

# Ends the script with one sentence.
fail() {
    echo "${0##*/}: $*" >&2
    exit 1
}

say() {
    echo "== $*"
}

# Configures and builds a preset, quietly unless something goes wrong.
#   build_preset PRESET [TARGET...]
build_preset() {
    local preset=$1 targets=() log
    shift
    [[ $# -eq 0 ]] || targets=(--target "$@")
    log=$root/build/$preset-build.log
    mkdir -p "$root/build"
    say "building $preset"
    (
        cd "$root"
        cmake --preset "$preset" &&
            cmake --build --preset "$preset" --parallel "$(nproc)" "${targets[@]}"
    ) >"$log" 2>&1 || {
        cat "$log" >&2
        fail "the $preset build failed; its output is above and in $log"
    }
    grep -E '^-- No (tests|programs):' "$log" || true
}

# Runs the tests of a built preset. ctest's own summary comes last; just before it, the reasons
# of the tests that were skipped.
#   run_ctest PRESET [CTEST_OPTION...]
run_ctest() {
    local preset=$1 log=$root/build/$1/Testing/Temporary/LastTest.log
    shift
    say "testing $preset"
    "${ctest_wrapper[@]}" ctest --test-dir "$root/build/$preset" --parallel "$(nproc)" --output-on-failure \
        --no-tests=error "$@" |
        awk -v log_path="$log" '
            /tests passed, .* failed out of/ { held = 1 }
            held { summary = summary $0 "\n"; next }
            { print; fflush() }
            END {
                while ((getline line < log_path) > 0)
                    if (sub(/^.*:[0-9]+:test_/, "", line) && sub(/:IGNORE: */, ": ", line)) {
                        print "skipped: " line
                        n_skipped++
                    }
                if (n_skipped)
                    print n_skipped " skipped; the programs that hold them count as passed below"
                printf "%s", summary
            }'
}
