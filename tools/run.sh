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
# Why the Qt viewer cannot run. The bindings of Debian 13 cannot be imported.
reason=''
if [[ -z ${DISPLAY:-} ]]; then
  reason="DISPLAY is not set"
elif ! "$VIRTUAL_ENV/bin/python" -c 'import rviz.librviz_sip' 2>/dev/null; then
  reason="RViz has no Python bindings here"
fi
if [[ $reason && " $* " != *" show_viz:="* ]]; then
  arguments+=("show_viz:=false")
  if [[ " $* " == *" web:="* ]]; then
    echo "flatland: $reason, running without the Qt viewer (show_viz:=false)"
  else
    echo "flatland: $reason, running with the viewer for the browser (show_viz:=false web:=true)"
    arguments+=("web:=true")
  fi
fi
# Output to a pipe or a file is not buffered either.
export PYTHONUNBUFFERED=1
exec roslaunch flatland server.launch "${arguments[@]}"
