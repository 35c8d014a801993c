#!/usr/bin/env bash
# Downloads the sources of Box2D, from the source package of Debian or Ubuntu, to a folder. The package sources of the
# machine remain as they are; root is not required.
#   tools/box2d_source.sh FOLDER
set -euo pipefail
. "$(dirname "$0")/common.bash"
folder=$(realpath -m "${1:?usage: tools/box2d_source.sh FOLDER}")
if [[ -e $folder/LICENSE ]]; then exit 0; fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/lists/partial" "$work/cache/archives/partial"
apt-get indextargets --format 'deb-src $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Identifier: Packages' |
  grep -E ' (main|universe)$' | sort -u >"$work/sources.list"
apt=(apt-get -o "Dir::Etc::sourcelist=$work/sources.list" -o Dir::Etc::sourceparts=- -o "Dir::State::lists=$work/lists"
  -o "Dir::Cache=$work/cache" -o APT::Sandbox::User=)
cd "$work"
quietly "apt-get update" "${apt[@]}" update
quietly "apt-get source box2d" "${apt[@]}" source --download-only box2d
archive=$(echo box2d_2.4.1.orig.tar.*)
[[ -e $archive ]] || fail "the package box2d of this machine must have version 2.4.1, got: $(echo box2d_*.dsc)"
# The patches of Debian concern only the tests and the documentation of Box2D.
rm -rf "$folder.new"
mkdir -p "$folder.new"
tar -xf "$archive" -C "$folder.new" --strip-components=1
rm -rf "$folder"
mv "$folder.new" "$folder"
