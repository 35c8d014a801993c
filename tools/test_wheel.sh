#!/usr/bin/env bash
# Installs the wheel of `make wheel` in a fresh Debian system with Python only, and runs documented programs and the
# programs of the documentation there. The state hash of the office must be that of the installed build. Requires root.
#   tools/test_wheel.sh [bookworm|trixie]
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
suite=${1:-$(. /etc/os-release && echo "$VERSION_CODENAME")}

in_system=$(
  cat <<'EOS'
set -euo pipefail
sudo apt-get -qq update
sudo apt-get -qq install --no-install-recommends python3-venv >/dev/null
python3 -m venv ~/env
wheel=$(ls "$PWD"/dist/flatland_sim-*-"$(python3 -c 'import sys; print("cp%d%d" % sys.version_info[:2])')"-manylinux*.whl)
~/env/bin/pip -q install "$wheel[gym,draw]"
program=$PWD/tests/build/try_wheel.py
(cd && ~/env/bin/python "$program")
~/env/bin/pip -q install "$wheel[test]"
~/env/bin/pytest -p no:cacheprovider tests/unit/test_documentation.py
EOS
)
printed=$(tools/fresh_machine.sh --with dist "$suite" bash -c "$in_system" | tee /dev/stderr)
expected=$(cd / && "$OLDPWD/.venv/bin/python" "$OLDPWD/tests/build/try_wheel.py" --hash)
[[ $printed == *"$expected"* ]] || fail "the wheel must have the $expected of the build of this machine"
echo "flatland: the wheel passed, with the $expected"
