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

# Renders the recording that many tests play, so that not each of them does: tests/service/played.h.
# Only once, by the release build, which is quick.
make_test_recording() {
    [[ -z ${SHEF_TEST_RECORDING:-} ]] || return 0
    local path=$root/build/test-recording/played
    build_preset release shefsim
    rm -rf "$path"
    mkdir -p "${path%/*}"
    "$root/build/release/bin/shefsim" render --scene simple_boxes --speed 0.2 --seconds 0.4 \
        --seed 3 --truth-every 4 --out "$path" >/dev/null
    export SHEF_TEST_RECORDING=$path
}

# Runs the tests of a built preset. ctest's own summary comes last; just before it, the reasons
# of the tests that were skipped. What ran is added to the tally.
#   run_ctest PRESET [CTEST_OPTION...]
run_ctest() {
    local preset=$1 log=$root/build/$1/Testing/Temporary/LastTest.log status=0
    shift
    say "testing $preset"
    rm -f "$log"
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
            }' || status=$?
    [[ -z ${SHEF_TALLY:-} || ! -e $log ]] || count_tests "$log" >>"$SHEF_TALLY"
    return $status
}

# Prints how many tests passed, failed and were skipped by a log of ctest. The functions in a
# program count one by one; a program without them counts as one, and so does one that ended badly
# although none of them failed.
count_tests() {
    awk '
        function end_program() {
            if (name == "") return
            if (result != "Passed" && failed == 0) n_failed++
            else if (result == "Passed" && passed + skipped == 0) n_passed++
            n_passed += passed; n_failed += failed; n_skipped += skipped
        }
        /^[0-9]+\/[0-9]+ Testing: / {
            end_program()
            name = $3; result = ""; passed = failed = skipped = 0
        }
        /:[0-9]+:test_[A-Za-z0-9_]+:PASS/ { passed++ }
        /:[0-9]+:test_[A-Za-z0-9_]+:FAIL/ { failed++ }
        /:[0-9]+:test_[A-Za-z0-9_]+:IGNORE/ { skipped++ }
        /^Test Passed\.$/ { result = "Passed" }
        END { end_program(); print n_passed + 0, n_failed + 0, n_skipped + 0 }' "$1"
}

# Starts a tally, unless a script that called this one has.
begin_tally() {
    [[ -z ${SHEF_TALLY:-} ]] || return 0
    mkdir -p "$root/build"
    export SHEF_TALLY=$root/build/tally
    : >"$SHEF_TALLY"
    owns_tally=yes
}

# Prints the closing line of whoever began the tally. Runs that did not get as far have none.
#   end_tally RUNS    of ctest that there should have been
end_tally() {
    [[ ${owns_tally:-no} = yes ]] || return 0
    [[ $(wc -l <"$SHEF_TALLY") -eq $1 ]] || fail "not everything was run; the reason is above"
    awk '{ passed += $1; failed += $2; skipped += $3 }
        END { printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped }' "$SHEF_TALLY"
}
