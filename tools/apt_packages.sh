#!/usr/bin/env bash
# Installs the missing Debian packages of packages-apt.txt.
#   tools/apt_packages.sh GROUP...      GROUP: run, catkin, dev
set -euo pipefail
cd "$(dirname "$0")/.."

groups=" $* "
required=()
while read -r group package _; do
  [[ $group == \#* || -z $group ]] && continue
  [[ $groups == *" $group "* ]] && required+=("$package")
done <packages-apt.txt

if ! command -v dpkg-query >/dev/null; then
  echo "flatland: not a Debian system. Install the equivalents of these packages: ${required[*]}" >&2
  exit 1
fi
installed=" $(dpkg-query -W -f '${db:Status-Status}:${Package}\n' "${required[@]}" 2>/dev/null |
  sed -n 's/^installed://p' | tr '\n' ' ') " || true
missing=()
for package in "${required[@]}"; do
  [[ $installed == *" $package "* ]] || missing+=("$package")
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

sudo=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "flatland: Debian packages are missing, and sudo is not available. Run as root:" >&2
    echo "  apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  sudo=(sudo)
fi
echo "flatland: installing ${#missing[@]} Debian packages${sudo:+ with sudo}; this takes minutes (reasons: packages-apt.txt)"
echo "  ${missing[*]}" | fold -s -w 100
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt_get() {
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q "$@" </dev/null >"$log" 2>&1
}
# The package lists may be out of date or absent. They are updated only if a package is missing.
if ! apt_get update || ! apt_get install -y --no-install-recommends "${missing[@]}"; then
  cat "$log" >&2
  echo "flatland: apt-get failed (see above). Packages to be installed: ${missing[*]}" >&2
  exit 1
fi
