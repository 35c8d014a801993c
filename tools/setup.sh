#!/usr/bin/env bash
# Sets flatland up in .venv, doing only what is missing or out of date.
#   tools/setup.sh run    what running the simulator needs
#   tools/setup.sh dev    also what the tests, the linters and catkin need
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
level=${1:-run}
venv=$root/.venv
stamps=$venv/flatland-setup

fail() {
  echo "flatland: $*" >&2
  exit 1
}

# Runs a command quietly; shows what it said only when it fails.
quietly() {
  local what=$1 log
  shift
  log=$(mktemp)
  if ! "$@" >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    fail "$what failed (see above)"
  fi
  rm -f "$log"
}

# Two setups at once, say from two terminals, would build into the same folder.
mkdir -p build
exec 9>build/.setup.lock
flock 9

case $level in
  run) tools/apt_packages.sh run; extra= ;;
  dev) tools/apt_packages.sh run catkin dev; extra='[dev]' ;;
  *) fail "tools/setup.sh run|dev, got '$level'" ;;
esac

# ROS's Python modules are Debian's, so only Debian's interpreter sees them.
python=/usr/bin/python3
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
  fail "$python must be 3.11 or newer, got $("$python" --version)"

# A virtual environment does not survive a move: its programs name it by path.
venv_is="$("$python" --version) $venv"
if [[ ! -x $venv/bin/python || $(cat "$stamps/venv" 2>/dev/null) != "$venv_is" ]]; then
  echo "flatland: making $venv"
  quietly "python3 -m venv" "$python" -m venv --clear --system-site-packages "$venv"
  mkdir -p "$stamps"
  echo "$venv_is" >"$stamps/venv"
fi
pip=("$venv/bin/python" -m pip --disable-pip-version-check --no-input)

# Whatever goes into the install; what was built into flatland/ does not.
sources() {
  local inputs=(pyproject.toml CMakeLists.txt package.xml README.md LICENSE flatland_plugins.xml
    cmake src/cpp flatland msg srv launch rviz worlds scripts) there=() input
  for input in "${inputs[@]}"; do
    if [[ -e $input ]]; then there+=("$input"); fi
  done
  find "${there[@]}" \( -path flatland/msg -o -path flatland/srv -o -name __pycache__ \) -prune -o \
    ! -type d ! -name '*.so' -print0 | sort -z
}
content=$(sources | xargs -0 sha256sum | sha256sum)
# `dev` is more than `run`, so it serves both.
if [[ $(cat "$stamps/dev" 2>/dev/null) == "$content" || $(cat "$stamps/$level" 2>/dev/null) == "$content" ]]; then
  exit 0
fi

# Without isolation the build folder is reused, and a changed source costs seconds.
requires=()
while IFS= read -r requirement; do requires+=("$requirement"); done < <("$venv/bin/python" -c '
import tomllib
print(*tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"], sep="\n")')
echo "flatland: building and installing into $venv"
quietly "pip install of the build's requirements" "${pip[@]}" install "${requires[@]}"
quietly "pip install" "${pip[@]}" install --no-build-isolation --config-settings=build-dir=build/pip ".$extra"

# A Python started in this folder finds the package's sources before the installed one, so they get what
# was built too; each file is replaced at once, never while another process reads it.
site=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')/flatland
(cd "$site" && find . -name '_core*.so' -o -path './msg/*.py' -o -path './srv/*.py') | while IFS= read -r file; do
  mkdir -p "flatland/$(dirname "$file")"
  cp "$site/$file" "flatland/$file.new"
  mv "flatland/$file.new" "flatland/$file"
done

rm -f "$stamps/run" "$stamps/dev"
echo "$content" >"$stamps/$level"
echo "flatland: ready"
