#!/usr/bin/env bash
# Runs the tests of ROS 2 with the wheels of Kilted and, except for those marked `kilted`, of Jazzy.
#   tools/test_ros2.sh [ARGUMENTS OF PYTEST]
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash

missing=$(no_ros2_wheels /usr/bin/python3)
if [[ -n $missing ]]; then
  echo "flatland: tests/ros2 are skipped: $missing"
  exit 0
fi
tools/ros2_setup.sh kilted &
kilted=$!
tools/ros2_setup.sh jazzy
wait "$kilted"

if [[ $# == 0 ]]; then set -- tests/ros2; fi
status=0
# Packages of ROS 1 have the names of those of ROS 2, and the conftest.py of tests/ is for the others.
unset PYTHONPATH VIRTUAL_ENV
for distribution in kilted jazzy; do
  selected=()
  [[ $distribution == jazzy ]] && selected=(-m "not kilted")
  build/ros2/$distribution/bin/python -m pytest --confcutdir=tests/ros2 -p no:cacheprovider --numprocesses 3 \
    --dist loadfile "${selected[@]}" "$@" || status=1
done
exit $status
