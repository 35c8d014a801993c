#!/usr/bin/env bash
# Runs the tests of programs with large requirements, in an environment of their own: examples/learning and
# examples/sweep.
#   tools/test_learning.sh [ARGUMENTS OF PYTEST]
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
root=$PWD
venv=$root/build/learning/venv
python=$root/.venv/bin/python

# matplotlib and numpy are those of Debian.
requires=$(for extra in gym learning ray test; do
  requirements "$python" project optional-dependencies "$extra"
done | grep -v '^flatland-sim\|^matplotlib' && echo 'numpy<2')
identity="$("$python" --version) $venv $requires"
if [[ $(cat "$venv/flatland-requirements" 2>/dev/null) != "$identity" ]]; then
  echo "flatland: installing PyTorch and Ray in $venv"
  mkdir -p build/learning
  /usr/bin/python3 -m venv --clear --system-site-packages "$venv"
  pip_install "pip install of PyTorch and Ray" "$venv/bin/python" -r <(echo "$requires")
  # flatland, and what else it requires, come from .venv.
  site='import sysconfig; print(sysconfig.get_path("platlib"))'
  "$python" -c "$site" >"$("$venv/bin/python" -c "$site")/flatland.pth"
  echo "$identity" >"$venv/flatland-requirements"
fi

. ./setup.bash
if [[ $# == 0 ]]; then set -- tests/learning; fi
PATH=$venv/bin:$PATH "$venv/bin/python" -m pytest "$@"
