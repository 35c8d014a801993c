#!/usr/bin/env bash
# Builds the documentation site. Warnings, such as broken links, are errors.
#   tools/build_docs.sh [FOLDER]      (default: build/docs/html; an existing folder is replaced)
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
venv=$root/build/docs/venv
python=$root/.venv/bin/python
output=${1:-build/docs/html}

# Sphinx has an environment of its own: the programs of ROS import what is installed in .venv.
requirements=$("$python" -c '
import tomllib
print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["docs"], sep="\n")')
identity="$("$python" --version) $venv $requirements"
if [[ $(cat "$venv/flatland-requirements" 2>/dev/null) != "$identity" ]]; then
  echo "flatland: installing Sphinx in $venv"
  mkdir -p build/docs
  /usr/bin/python3 -m venv --clear --system-site-packages "$venv"
  log=$(mktemp)
  if ! "$venv/bin/python" -m pip --disable-pip-version-check --no-input install -r <(echo "$requirements") \
    >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    exit 1
  fi
  rm -f "$log"
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
