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
