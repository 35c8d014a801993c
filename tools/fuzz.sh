#!/usr/bin/env bash
# Runs the fuzz targets of tests/fuzz. Arguments are those of tests/fuzz/run.py.
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
packages=$PWD/build/fuzz/packages
python=$PWD/.venv/bin/python

# Atheris is only on the path of this script: .venv is the environment of the simulator.
requires=$(requirements "$python" project optional-dependencies fuzz)
identity="$("$python" --version) $requires"
if [[ $(cat "$packages/flatland-requirements" 2>/dev/null) != "$identity" ]]; then
  echo "flatland: installing atheris in build/fuzz/packages"
  rm -rf "$packages"
  mkdir -p build/fuzz
  pip_install "pip install of atheris" "$python" --target "$packages" -r <(echo "$requires")
  echo "$identity" >"$packages/flatland-requirements"
fi
PYTHONPATH="$PWD:$PWD/tests/support:$packages${PYTHONPATH:+:$PYTHONPATH}" \
  exec nice -n 10 "$python" tests/fuzz/run.py "$@"
