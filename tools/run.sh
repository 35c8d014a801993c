#!/usr/bin/env bash
# Runs the simulator: roslaunch flatland server.launch in the environment of .venv.
#   tools/run.sh [WORLD] [roslaunch arguments...]
# roslaunch starts a roscore if none answers, and ends all that it started on SIGINT and SIGTERM.
set -euo pipefail
. "$(dirname "$0")/../setup.bash"

world=${1:-}
shift || true
arguments=("$@")
if [[ -n $world ]]; then
  if [[ ! -f $world ]]; then
    echo "flatland: there is no world file $world" >&2
    exit 1
  fi
  arguments+=("world_path:=$(realpath "$world")")
fi
if [[ -z ${DISPLAY:-} && " $* " != *" show_viz:="* ]]; then
  echo "flatland: no display (DISPLAY is not set), so this runs without a window: show_viz:=false"
  arguments+=("show_viz:=false")
fi
# Into a pipe or a file, the node's lines go out as they come too.
export PYTHONUNBUFFERED=1
exec roslaunch flatland server.launch "${arguments[@]}"
