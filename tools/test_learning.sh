#!/usr/bin/env bash
# Runs the tests of programs with large requirements, in an environment of their own: examples/learning and
# `flatland test --ray`.
#   tools/test_learning.sh [ARGUMENTS OF PYTEST]
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
root=$PWD
venv=$root/build/learning/venv
python=$root/.venv/bin/python

# matplotlib and numpy are those of Debian. The tests read results in the Parquet format with pandas.
numpy=$("$python" -c 'import numpy; print(numpy.__version__)')
requires=$(for extra in gym learning ray test; do
  requirements "$python" project optional-dependencies "$extra"
done | grep -v '^flatland-sim\|^matplotlib' && printf '%s\n' "numpy==$numpy" "pandas>=2.1,<3")
make_environment "PyTorch and Ray" "$venv" "$requires"

. ./setup.bash
if [[ $# == 0 ]]; then set -- tests/learning; fi
PATH=$venv/bin:$PATH "$venv/bin/python" -m pytest "$@"
