#!/usr/bin/env bash
# Builds and installs flatland, the example package and a client in C++ in a catkin workspace, the
# folder "build/work space", for the tests in tests/build/workspace. Only what has changed since the
# last call is built. The caller holds build/.workspace.lock.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
workspace="$root/build/work space"

mkdir -p "$workspace/src"
touch build/CATKIN_IGNORE  # The checkout in the workspace contains the workspace.
cd "$workspace"
ln -sfn "$root" src/flatland
ln -sfn "$root/examples/my_robots" src/my_robots
ln -sfn "$root/tests/build/workspace/client" src/a_client
# A build folder cannot be moved. The install space must not keep what is no longer installed.
if [[ -f build/CMakeCache.txt ]] && ! grep -qxF "CMAKE_CACHEFILE_DIR:INTERNAL=$workspace/build" build/CMakeCache.txt; then
  rm -rf build devel
fi
rm -rf install

# The environment of a new login, apart from compilers that take what they have compiled already from
# the cache of the user, also in another clone. Messages are generated for C++ and Python only, and
# nothing is optimized, for a short build; the installation by pip uses the defaults.
login=(env -i "HOME=$workspace" "PATH=/usr/lib/ccache:/usr/bin:/bin" LANG=C.UTF-8
  "CCACHE_DIR=${CCACHE_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/ccache}"
  "CCACHE_BASEDIR=$workspace" CCACHE_NOHASHDIR=1 ROS_LANG_DISABLE=geneus:genlisp:gennodejs)
"${login[@]}" catkin_make install -j2 -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  "-DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O0 -DNDEBUG"
