#!/usr/bin/env bash
# Builds a wheel in dist/ that requires no other package than those of its metadata: it contains Box2D, and its
# extension runs with glibc 2.17 or later. It contains the messages if the packages of ROS are installed.
#   tools/build_wheel.sh [PYTHON]     for another Python interpreter than /usr/bin/python3
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
python=${1:-/usr/bin/python3}
name=$("$python" -c 'import sys; print("cp%d%d" % sys.version_info[:2])') || fail "cannot run $python"
work=$PWD/build/wheel
venv=$work/$name/venv
unset PYTHONPATH VIRTUAL_ENV

requires=$(requirements "$python" project optional-dependencies wheel)
if [[ $(cat "$venv/flatland-requirements" 2>/dev/null) != "$requires" ]]; then
  echo "flatland: installing the compiler in $venv"
  "$python" -m venv --clear "$venv"
  pip_install "pip install of the compiler" "$venv/bin/python" -r <(echo "$requires")
  echo "$requires" >"$venv/flatland-requirements"
fi
tools/box2d_source.sh "$work/box2d"

echo "flatland: building the wheel for $("$python" --version)"
rm -rf "$work/$name/wheel"
export FLATLAND_ZIG=$venv/bin/python CXX=$PWD/tools/wheel/zig_cxx PATH=$venv/bin:$PATH
quietly "pip wheel" "$venv/bin/python" -m pip --disable-pip-version-check --no-input wheel --no-deps \
  --config-settings="build-dir=build/wheel/$name/cmake" \
  --config-settings="cmake.define.FLATLAND_BOX2D_SOURCE=$work/box2d" --wheel-dir "$work/$name/wheel" .
quietly "auditwheel repair" auditwheel repair --plat manylinux_2_17_x86_64 --only-plat --wheel-dir dist \
  "$work/$name"/wheel/flatland_sim-*.whl
ls -sh1 dist/flatland_sim-*-"$name"-*.whl
