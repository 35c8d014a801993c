#!/usr/bin/env bash
# Runs `roslaunch flatland server.launch` in the environment of .venv.
#   tools/run.sh [WORLD] [roslaunch arguments...]
# roslaunch starts a roscore if none is running, and stops everything it started on SIGINT and SIGTERM.
set -euo pipefail
. "$(dirname "$0")/../setup.bash"

world=${1:-}
shift || true
arguments=("$@")
if [[ -n $world ]]; then
  if [[ ! -f $world ]]; then
    echo "flatland: world file not found: $world" >&2
    exit 1
  fi
  arguments+=("world_path:=$(realpath "$world")")
fi
if [[ -z ${DISPLAY:-} && " $* " != *" show_viz:="* ]]; then
  arguments+=("show_viz:=false")
  if [[ " $* " == *" web:="* ]]; then
    echo "flatland: DISPLAY is not set, running without the Qt viewer (show_viz:=false)"
  else
    echo "flatland: DISPLAY is not set, running with the viewer for the browser (show_viz:=false web:=true)"
    arguments+=("web:=true")
  fi
fi
# Output to a pipe or a file is not buffered either.
export PYTHONUNBUFFERED=1
exec roslaunch flatland server.launch "${arguments[@]}"
