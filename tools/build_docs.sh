#!/usr/bin/env bash
# Builds the documentation site. Warnings, such as broken links, are errors.
#   tools/build_docs.sh [FOLDER]      (default: build/docs/html; an existing folder is replaced)
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
root=$PWD
venv=$root/build/docs/venv
python=$root/.venv/bin/python
output=${1:-build/docs/html}

# Sphinx has an environment of its own: the programs of ROS import what is installed in .venv.
requires=$(requirements "$python" project optional-dependencies docs)
make_environment Sphinx "$venv" "$requires"

# All pages are built: Sphinx repeats no warnings of pages that have not changed.
rm -rf "$output"
env -u PYTHONPATH "$venv/bin/python" -m sphinx -b html -c docs -d "$(dirname "$output")/doctrees" -E -q \
  -W --keep-going . "$output"
"$python" tools/check_site.py "$output"
