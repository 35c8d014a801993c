#!/usr/bin/env bash
# Runs the fuzz targets of tests/fuzz. Arguments are those of tests/fuzz/run.py.
set -euo pipefail
cd "$(dirname "$0")/.."
packages=$PWD/build/fuzz/packages
python=$PWD/.venv/bin/python

# Atheris is only on the path of this script: .venv is the environment of the simulator.
requirements=$("$python" -c '
import tomllib
print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["fuzz"], sep="\n")')
identity="$("$python" --version) $requirements"
if [[ $(cat "$packages/flatland-requirements" 2>/dev/null) != "$identity" ]]; then
  echo "flatland: installing atheris in build/fuzz/packages"
  rm -rf "$packages"
  mkdir -p build/fuzz
  log=$(mktemp)
  if ! "$python" -m pip --disable-pip-version-check --no-input install --target "$packages" \
    -r <(echo "$requirements") >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    exit 1
  fi
  rm -f "$log"
  echo "$identity" >"$packages/flatland-requirements"
fi
PYTHONPATH="$PWD:$PWD/tests/support:$packages${PYTHONPATH:+:$PYTHONPATH}" \
  exec nice -n 10 "$python" tests/fuzz/run.py "$@"
