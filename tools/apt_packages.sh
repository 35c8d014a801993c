#!/usr/bin/env bash
# Installs what is missing of the Debian packages in packages-apt.txt.
#   tools/apt_packages.sh GROUP...      GROUP: run, catkin, dev
set -euo pipefail
cd "$(dirname "$0")/.."

groups=" $* "
wanted=()
while read -r group package _; do
  [[ $group == \#* || -z $group ]] && continue
  [[ $groups == *" $group "* ]] && wanted+=("$package")
done <packages-apt.txt

if ! command -v dpkg-query >/dev/null; then
  echo "flatland: this is no Debian system; it needs the equivalents of: ${wanted[*]}" >&2
  exit 1
fi
installed=" $(dpkg-query -W -f '${db:Status-Status}:${Package}\n' "${wanted[@]}" 2>/dev/null |
  sed -n 's/^installed://p' | tr '\n' ' ') " || true
missing=()
for package in "${wanted[@]}"; do
  [[ $installed == *" $package "* ]] || missing+=("$package")
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

sudo=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "flatland: Debian packages are missing, and there is no sudo. As root, run:" >&2
    echo "  apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  sudo=(sudo)
fi
echo "flatland: installing ${#missing[@]} Debian packages${sudo:+ with sudo} (minutes; packages-apt.txt says why each):"
echo "  ${missing[*]}" | fold -s -w 100
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt_get() {
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q "$@" </dev/null >"$log" 2>&1
}
# The package lists may be old or absent; an update is only worth its time when something is missing.
if ! apt_get update || ! apt_get install -y --no-install-recommends "${missing[@]}"; then
  cat "$log" >&2
  echo "flatland: apt-get failed (see above). It was to install: ${missing[*]}" >&2
  exit 1
fi
