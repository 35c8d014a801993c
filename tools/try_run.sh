#!/usr/bin/env bash
# Runs `make run` until the robot publishes its pose, then stops it with SIGTERM. Fails if no pose arrives, if an error
# is logged, or if roslaunch does not end as usual.
set -euo pipefail
cd "$(dirname "$0")/.."
log=$(mktemp)
trap 'rm -f "$log"' EXIT

make run "$@" >"$log" 2>&1 &
until grep -q ': loaded "' "$log"; do
  if ! kill -0 $! 2>/dev/null; then
    cat "$log"
    exit 1
  fi
  sleep 1
done
status=0
(. ./setup.bash && timeout 60 rostopic echo -n 1 /odometry/ground_truth/pose/pose) || status=1
kill -TERM $!
wait $! || true  # make exits with the signal
cat "$log"
if grep -qE 'Traceback|FATAL' "$log" || ! grep -q 'shutting down processing monitor complete' "$log"; then status=1; fi
exit $status
