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
identity="$("$python" --version) $venv $requires"
if [[ $(cat "$venv/flatland-requirements" 2>/dev/null) != "$identity" ]]; then
  echo "flatland: installing Sphinx in $venv"
  mkdir -p build/docs
  /usr/bin/python3 -m venv --clear --system-site-packages "$venv"
  pip_install "pip install of Sphinx" "$venv/bin/python" -r <(echo "$requires")
  # The packages in .venv come after those of this environment.
  site='import sysconfig; print(sysconfig.get_path("platlib"))'
  "$python" -c "$site" >"$("$venv/bin/python" -c "$site")/flatland.pth"
  echo "$identity" >"$venv/flatland-requirements"
fi

# All pages are built: Sphinx repeats no warnings of pages that have not changed.
rm -rf "$output"
env -u PYTHONPATH "$venv/bin/python" -m sphinx -b html -c docs -d "$(dirname "$output")/doctrees" -E -q \
  -W --keep-going . "$output"
"$python" tools/check_site.py "$output"
