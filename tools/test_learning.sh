#!/usr/bin/env bash
# Runs the tests of examples/learning and of other programs with large requirements, in an
# environment of their own.
#   tools/test_learning.sh [ARGUMENTS OF PYTEST]
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
venv=$root/build/learning/venv
python=$root/.venv/bin/python

# All extras that `make setup-dev` does not install.
requirements=$("$python" -c '
import tomllib
extras = tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]
names = [name for name in ("gym", "learning", "ray", "test") if name in extras]
wanted = [each for name in names for each in extras[name] if not each.startswith("flatland-sim")]
# Debian has a matplotlib that fits its numpy.
print(*sorted({each for each in wanted if not each.startswith("matplotlib")}), "numpy<2", sep="\n")')
identity="$("$python" --version) $venv $requirements"
if [[ $(cat "$venv/flatland-requirements" 2>/dev/null) != "$identity" ]]; then
  echo "flatland: installing PyTorch and others in $venv"
  mkdir -p build/learning
  /usr/bin/python3 -m venv --clear --system-site-packages "$venv"
  log=$(mktemp)
  if ! "$venv/bin/python" -m pip --disable-pip-version-check --no-input install -r <(echo "$requirements") \
    >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    exit 1
  fi
  rm -f "$log"
  # flatland itself, and what else it requires, come from .venv.
  site='import sysconfig; print(sysconfig.get_path("platlib"))'
  "$python" -c "$site" >"$("$venv/bin/python" -c "$site")/flatland.pth"
  echo "$identity" >"$venv/flatland-requirements"
fi

. ./setup.bash
PATH=$venv/bin:$PATH "$venv/bin/python" -m pytest -m "learning" tests/learning "$@"
