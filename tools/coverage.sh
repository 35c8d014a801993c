#!/usr/bin/env bash
# Runs tests and reports the coverage of Python and C++. `make coverage` builds the extension for it.
#   tools/coverage.sh PYTEST_ARGUMENTS...
# Reports: build/coverage/html/python/index.html and build/coverage/html/cpp/index.html.
set -euo pipefail
cd "$(dirname "$0")/.."
build=$PWD/build/coverage
html=$build/html
rm -rf "$html"
mkdir -p "$html/cpp"
find "$build" -name '*.gcda' -delete -o -maxdepth 1 -name '.coverage*' -type f -delete

# Programs that the tests start are measured as well (`patch` in pyproject.toml).
export COVERAGE_FILE=$build/.coverage
status=0
PYTHONPATH="$build/python:${PYTHONPATH:-}" \
  coverage run --rcfile="$PWD/pyproject.toml" --source="$PWD/flatland" -m pytest "$@" || status=$?

coverage combine --quiet
coverage html --quiet --directory="$html/python"
gcovr --root . --filter src/cpp/ --html-details "$html/cpp/index.html" --txt "$build/cpp.txt" \
  --exclude-throw-branches --exclude-unreachable-branches --print-summary "$build" >"$build/cpp_summary.txt"
coverage report --skip-covered | tee "$build/python.txt"
cat "$build/cpp.txt"
echo "Python:  $(coverage report --format=total) % of lines and branches"
echo "C++:     $(sed -n 's/^lines: //p' "$build/cpp_summary.txt") of lines"
echo "Reports: $html/python/index.html $html/cpp/index.html"
exit $status
