#!/usr/bin/env bash
# Runs `make run` until the simulation runs, then stops it with SIGTERM. Fails if an error is logged.
set -euo pipefail
cd "$(dirname "$0")/.."
log=$(mktemp)
trap 'rm -f "$log"' EXIT

make run "$@" >"$log" 2>&1 &
until grep -q 'real-time factor' "$log"; do
  if ! kill -0 $! 2>/dev/null; then
    cat "$log"
    exit 1
  fi
  sleep 1
done
kill -TERM $!
wait $! || true  # make exits with the signal
cat "$log"
if grep -qE 'Traceback|FATAL' "$log"; then exit 1; fi
