# Functions of the scripts in this folder that install packages:   . tools/common.bash

# fail MESSAGE: prints an error and ends the script.
fail() {
  echo "flatland: $*" >&2
  exit 1
}

# quietly NAME COMMAND...: runs a command and prints its output only if it fails.
quietly() {
  local name=$1 log
  shift
  log=$(mktemp)
  if ! "$@" >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    fail "$name failed (see above)"
  fi
  rm -f "$log"
}

# replace_file SOURCE TARGET: copies a file atomically, since other processes may be reading the target.
replace_file() {
  if cmp -s "$1" "$2"; then return; fi
  cp "$1" "$2.new"
  mv "$2.new" "$2"
}

# requirements PYTHON KEY...: prints a list in pyproject.toml, one entry per line.
requirements() {
  "$1" - "${@:2}" <<'EOF'
import sys
import tomllib

with open("pyproject.toml", "rb") as file:
    value = tomllib.load(file)
for key in sys.argv[1:]:
    value = value[key]
print(*value, sep="\n")
EOF
}

# pip_install NAME PYTHON ARGUMENT...: runs `pip install` of a Python interpreter; NAME is for the error message.
pip_install() {
  quietly "$1" "$2" -m pip --disable-pip-version-check --no-input install "${@:3}"
}

# make_environment WHAT VENV REQUIREMENTS: creates a virtual environment with the given requirements, one per line, on
# top of .venv, unless it exists already. WHAT is for messages.
make_environment() {
  local what=$1 venv=$2 requires=$3 python=$PWD/.venv/bin/python identity site
  identity="$("$python" --version) $venv $requires"
  if [[ $(cat "$venv/flatland-requirements" 2>/dev/null) == "$identity" ]]; then return; fi
  echo "flatland: installing $what in $venv"
  mkdir -p "$(dirname "$venv")"
  /usr/bin/python3 -m venv --clear --system-site-packages "$venv"
  pip_install "pip install of $what" "$venv/bin/python" -r <(echo "$requires")
  # flatland, and what else is required, come from .venv, after the packages of this environment.
  site='import sysconfig; print(sysconfig.get_path("platlib"))'
  "$python" -c "$site" >"$("$venv/bin/python" -c "$site")/flatland.pth"
  echo "$identity" >"$venv/flatland-requirements"
}

# no_ros2_wheels PYTHON: prints the reason why there are no wheels of ROS 2 for an interpreter, or nothing.
no_ros2_wheels() {
  local platform
  platform=$("$1" -c 'import platform, sys; print("%d.%d" % sys.version_info[:2], platform.machine())')
  if [[ $platform != "3.11 x86_64" ]]; then
    echo "there are no wheels of ROS 2 for Python $platform, only for Python 3.11 x86_64 (Debian 12)"
  fi
}
