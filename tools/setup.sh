#!/usr/bin/env bash
# Sets up flatland in .venv. Only missing or outdated parts are installed.
#   tools/setup.sh run    requirements of the simulator
#   tools/setup.sh dev    also requirements of the tests, the linters and catkin
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
root=$PWD
# A shell may have the environment of another clone, whose packages must not count as installed here.
unset PYTHONPATH VIRTUAL_ENV
level=${1:-run}
venv=$root/.venv
stamps=$venv/flatland-setup

# Concurrent runs, for example in two terminals, would build in the same folder.
mkdir -p build
exec 9>build/.setup.lock
flock 9

case $level in
  run) tools/apt_packages.sh run; extra='[mcap]' ;;
  dev) tools/apt_packages.sh run catkin dev; extra='[mcap,dev]' ;;
  *) fail "the argument of tools/setup.sh must be run or dev, got '$level'" ;;
esac

# The Python modules of ROS are Debian packages, which only the interpreter of Debian can import.
python=/usr/bin/python3
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
  fail "$python must be Python 3.11 or later, got $("$python" --version)"

# A virtual environment cannot be moved: its programs contain its path.
venv_identity="$("$python" --version) $venv"
if [[ ! -x $venv/bin/python || $(cat "$stamps/venv" 2>/dev/null) != "$venv_identity" ]]; then
  echo "flatland: creating $venv"
  quietly "python3 -m venv" "$python" -m venv --clear --system-site-packages "$venv"
  mkdir -p "$stamps"
  echo "$venv_identity" >"$stamps/venv"
fi
# Excludes the installed ROS packages from searches of a workspace that contains this folder.
touch "$venv/CATKIN_IGNORE"

# uPlot is installed with the package. Without it, the page says that it has no plots.
if [[ $level == dev ]]; then
  tools/npm_packages.sh dev
elif ! tools/npm_packages.sh run 2>build/npm.log; then
  echo "flatland: npm could not install uPlot, which draws the plots of the browser viewer (see build/npm.log); the next set-up tries again"
fi

# Prints all files that are installed from the source tree, without build results in flatland/.
sources() {
  local inputs=(pyproject.toml CMakeLists.txt README.md LICENSE flatland_plugins.xml
    cmake src/cpp flatland msg srv launch rviz worlds scripts catkin compat) existing=() input
  for input in "${inputs[@]}"; do
    if [[ -e $input ]]; then existing+=("$input"); fi
  done
  find "${existing[@]}" \( -path flatland/msg -o -path flatland/srv -o -name __pycache__ \) -prune -o \
    -xtype f ! -name '*.so' -print0 | sort -z
}
content=$(sources | xargs -0 sha256sum | sha256sum)
# `dev` includes `run`.
if [[ $(cat "$stamps/dev" 2>/dev/null) == "$content" || $(cat "$stamps/$level" 2>/dev/null) == "$content" ]]; then
  exit 0
fi

# Builds without isolation reuse the build folder, so that a changed source is rebuilt within seconds.
requires=$(requirements "$venv/bin/python" build-system requires)
echo "flatland: building and installing into $venv"
pip_install "pip install of the build requirements" "$venv/bin/python" -r <(echo "$requires")
pip_install "pip install" "$venv/bin/python" --no-build-isolation --config-settings=build-dir=build/pip ".$extra"
if [[ $level == dev ]]; then
  bare=$(requirements "$venv/bin/python" tool flatland dev-without-requirements)
  pip_install "pip install" "$venv/bin/python" --no-deps -r <(echo "$bare")
fi

# Python started in this folder imports the source package, which therefore requires the build results as well. It must
# not import flatland_msgs from here, which is another package in ROS 2.
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')
rm -rf flatland_msgs
(cd "$site" && find flatland -name '_core*.so' -o -path 'flatland/msg/*.py' -o -path 'flatland/srv/*.py') |
  while IFS= read -r file; do
    mkdir -p "$(dirname "$file")"
    replace_file "$site/$file" "$file"
  done

if [[ $level == dev ]]; then
  echo "flatland: building the catkin workspace of the tests"
  if ! flock build/.workspace.lock tools/catkin_workspace.sh >build/workspace.log 2>&1; then
    echo "flatland: the catkin workspace could not be built (see build/workspace.log); its tests try again"
  fi
fi

rm -f "$stamps/run" "$stamps/dev"
echo "$content" >"$stamps/$level"
echo "flatland: ready"
