#!/usr/bin/env bash
# Sets up ROS 2 in build/ros2/DISTRIBUTION: rclpy and its messages as wheels, the messages that wheels lack, and
# flatland of this clone. Only outdated parts are installed.
#   tools/ros2_setup.sh kilted|jazzy
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
root=$PWD
# Packages of ROS 1 have the names of those of ROS 2.
unset PYTHONPATH VIRTUAL_ENV
distribution=${1:-}
requirements=tools/ros2/$distribution.txt
[[ $distribution == kilted || $distribution == jazzy ]] ||
  fail "the argument of tools/ros2_setup.sh must be kilted or jazzy, got '$distribution'"
python=/usr/bin/python3
missing=$(no_ros2_wheels "$python")
[[ -z $missing ]] || fail "$missing"
compgen -G 'flatland/_core*.so' >/dev/null || fail "not set up, run 'make setup' in $root"
venv=$root/build/ros2/$distribution

mkdir -p build/ros2
# The wheels contain package.xml files, which are not packages of a workspace that contains this clone.
touch build/ros2/CATKIN_IGNORE build/ros2/COLCON_IGNORE
exec 9>"build/ros2/.$distribution.lock"
flock 9

identity="$("$python" --version) $venv $(cat tools/ros2/common.txt "$requirements")"
if [[ $(cat "$venv/flatland-requirements" 2>/dev/null) != "$identity" ]]; then
  echo "flatland: installing ROS 2 ${distribution^} in $venv"
  quietly "python3 -m venv" "$python" -m venv --clear "$venv"
  # All packages are listed, so that no versions are searched for; Python compiles what it imports.
  pip_install "pip install of ROS 2" "$venv/bin/python" --no-compile --no-deps -r "$requirements"
  echo "$identity" >"$venv/flatland-requirements"
fi

packages=(tools/ros2/interfaces/*/ ros2/flatland_msgs/)
content=$(find -L "${packages[@]}" -type f -print0 | sort -z | xargs -0 sha256sum tools/ros2_messages.py | sha256sum)
if [[ $(cat "$venv/flatland-messages" 2>/dev/null) != "$content" ]]; then
  echo "flatland: generating messages for ROS 2 ${distribution^}"
  rm -f "$venv/flatland-messages"
  quietly tools/ros2_messages.py "$venv/bin/python" tools/ros2_messages.py "${packages[@]}"
  echo "$content" >"$venv/flatland-messages"
fi

# The package itself, but not the folder that contains it, where Python would find more than this package.
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
ln -sfn "$root/flatland" "$site/flatland"
program() { # NAME MODULE: creates a command from the function main of a module
  cat >"$venv/bin/$1" <<EOF
#!$venv/bin/python
import sys

from $2 import main

if __name__ == "__main__":  # Worker processes import this file.
    sys.exit(main())
EOF
  chmod +x "$venv/bin/$1"
}
program flatland flatland.cli
program flatland_ros2 flatland.ros2.node
