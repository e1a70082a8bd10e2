# A service of one's own for the scripts in tools/. Sourced after common.sh.
# shellcheck shell=bash

# Set by start_service.
service_pid=

# Starts shefd as the present user with a private socket, and waits until it answers.
#   start_service FOLDER [SHEFD_OPTION...]   FOLDER gets socket, recordings and log
start_service() {
    local folder
    mkdir -p "$1/recordings"
    folder=$(cd "$1" && pwd) # the settings take full paths only
    shift
    # The path of a socket may have 107 bytes: a folder of its own, with a short name.
    socket_folder=$(mktemp -d /tmp/shef.XXXXXX)
    export SHEF_SOCKET=$socket_folder/s
    "$root/build/release/bin/shefd" --set "control.socket=$SHEF_SOCKET" --set control.group= \
        --set "record.folder=$folder/recordings" "$@" >"$folder/shefd.log" 2>&1 &
    service_pid=$!
    trap stop_service EXIT
    for _ in $(seq 50); do
        "$root/build/release/bin/shefctl" status >/dev/null 2>&1 && return
        kill -0 "$service_pid" 2>/dev/null || break
        sleep 0.1
    done
    cat "$folder/shefd.log" >&2
    fail "shefd did not start; its sentences are above"
}

# Ends it as systemd would. Fails if it does not leave within five seconds.
stop_service() {
    trap - EXIT
    kill -TERM "$service_pid" 2>/dev/null || true
    for _ in $(seq 50); do
        kill -0 "$service_pid" 2>/dev/null || break
        sleep 0.1
    done
    if kill -9 "$service_pid" 2>/dev/null; then
        fail "shefd did not end within 5 s after SIGTERM"
    fi
    wait "$service_pid" || true
    rm -rf "$socket_folder"
}
