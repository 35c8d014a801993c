# Sets the environment variables of flatland in a shell:   . ./setup.bash
# Enables roslaunch flatland ..., rosservice, rosmsg show flatland/Collisions and `import flatland`.

_flatland_root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if [ ! -f "$_flatland_root/.venv/share/flatland/package.xml" ]; then
  echo "flatland: not set up, run 'make setup' in $_flatland_root" >&2
  unset _flatland_root
  return 1
fi

# _flatland_prepend VARIABLE ENTRY...: prepends entries to a list of paths, unless they are already in it.
_flatland_prepend() {
  local name=$1 list entry
  shift
  list=${!name-}
  for entry in "$@"; do
    case ":$list:" in
      *":$entry:"*) ;;
      *) list=$entry${list:+:$list} ;;
    esac
  done
  export "$name=$list"
}

_flatland_prepend PATH "$_flatland_root/.venv/bin"
export VIRTUAL_ENV=$_flatland_root/.venv
# /usr/share contains the ROS packages of Debian.
_flatland_prepend ROS_PACKAGE_PATH /usr/share "$_flatland_root/.venv/share"
# rosservice, rostopic and rviz of Debian use the Python of the system, independently of PATH.
_flatland_prepend PYTHONPATH "$("$_flatland_root/.venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')"

export ROS_DISTRO=${ROS_DISTRO:-Debian}
export ROS_VERSION=1
export ROS_PYTHON_VERSION=3
export ROS_ETC_DIR=${ROS_ETC_DIR:-/etc/ros}
export ROS_MASTER_URI=${ROS_MASTER_URI:-http://localhost:11311}

# Completion of the command flatland, if argcomplete is installed.
case $- in
  *i*)
    eval "$("$_flatland_root/.venv/bin/python" -c '
import argcomplete
print(argcomplete.shellcode(["flatland"], shell="bash"))' 2>/dev/null)"
    ;;
esac

unset -f _flatland_prepend
unset _flatland_root
