#!/usr/bin/env bash
# Runs a command in a clone of this repository, on a fresh Debian system in a folder. Requires root.
#   tools/fresh_machine.sh [OPTION...] bookworm|trixie COMMAND...
#     --root       as root, in /root/flatland, as in a container; otherwise as a user with sudo, in /home/user/flatland
#     --again      in the system that the last call left, with the clone at HEAD; otherwise in a new system
#     --with PATH  with a copy of a file or folder of the work tree that is not committed, for example dist
# The clone contains the commits up to HEAD. The system consists of essential packages, ca-certificates, git, make and
# sudo; package sources, certificates, proxies, and the configuration of pip and npm are those of this machine. It
# remains in build/fresh, or in FLATLAND_FRESH_DIR. All processes and mounts end with the command.
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/common.bash
root=$PWD

usage="usage: tools/fresh_machine.sh [--root] [--again] [--with PATH] bookworm|trixie COMMAND..."
user=user home=/home/user again='' with=()
while [[ ${1-} == --* ]]; do
  case $1 in
    --root) user=root home=/root ;;
    --again) again=1 ;;
    --with) with+=("${2:?$usage}") && shift ;;
    *) fail "$usage" ;;
  esac
  shift
done
[[ $# -ge 2 && $1 =~ ^(bookworm|trixie)$ ]] || fail "$usage"
suite=$1
shift
[[ $(id -u) -eq 0 ]] || fail "tools/fresh_machine.sh must be run by root"

folder=${FLATLAND_FRESH_DIR:-$root/build/fresh}
base=$folder/$suite.base system=$folder/$suite clone=$folder/$suite$home/flatland
mkdir -p "$folder"
exec 9>"$folder/$suite.lock"
flock --nonblock 9 || fail "$system is in use by another process"
tools/apt_packages.sh fresh >&2

# The Debian archives of this machine, for the other release: lines of an apt sources.list.
sources() {
  local codename
  codename=$(. /etc/os-release && echo "${VERSION_CODENAME-}")
  apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 'Identifier: Packages' |
    sed -nE "s|^(.*) $codename(-[a-z]+)? (main)$|deb \1 $suite\2 \3|p" | sort -u
}

# Certificate authorities, settings of apt, pip and npm, and name resolution of this machine.
configure() {
  local target=$1
  sources >"$target/etc/apt/sources.list"
  apt-config dump | grep -E '^Acquire::(https?::|Check|Retries)' >"$target/etc/apt/apt.conf.d/90machine" || true
  cp -L /etc/resolv.conf /etc/hosts "$target/etc"
  if [[ -e /etc/pip.conf ]]; then cp /etc/pip.conf "$target/etc"; fi
  # update-ca-certificates expects one certificate per file.
  csplit --quiet --elide-empty-files --prefix="$target/usr/local/share/ca-certificates/machine-" \
    --suffix-format=%03d.crt "${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}" '/BEGIN CERTIFICATE/' '{*}'
  quietly update-ca-certificates chroot "$target" update-ca-certificates
  # There is no init process that could start services.
  printf '#!/bin/sh\nexit 101\n' >"$target/usr/sbin/policy-rc.d"
  chmod +x "$target/usr/sbin/policy-rc.d"
  chroot "$target" useradd --create-home --shell /bin/bash user
  printf '%s\n' 'user ALL=(ALL) NOPASSWD: ALL' 'Defaults env_keep += "http_proxy https_proxy no_proxy"' \
    >"$target/etc/sudoers.d/user"
  for file in .npmrc .config/pip/pip.conf; do
    if [[ -e ~/$file ]]; then
      install -D "$HOME/$file" "$target/root/$file"
      install -D -o "$(stat -c %u "$target/home/user")" "$HOME/$file" "$target/home/user/$file"
    fi
  done
}

if [[ ! -d $base ]]; then
  mirror=$(sources | sed -nE "s/^deb (.*) $suite main$/\1/p" | head -n 1)
  [[ $mirror ]] || fail "the package sources of this machine contain no archive of a Debian release"
  echo "flatland: creating a system with Debian's $suite in $base" >&2
  rm -rf "$base.new"
  quietly debootstrap unshare --mount debootstrap --variant=minbase --include=ca-certificates,git,make,sudo \
    "$suite" "$base.new" "$mirror"
  configure "$base.new"
  mv "$base.new" "$base"
fi
if [[ ! $again || ! -d $system ]]; then
  rm -rf --one-file-system "$system"
  cp -a "$base" "$system.new"
  mv "$system.new" "$system"
fi

# Git compares neither owners nor times of their changes, so that `reset` does not write unchanged files again, which
# `make` would then build again.
git=(git -c safe.directory='*' -c core.checkStat=minimal -c core.trustctime=false)
if [[ ! -d $clone ]]; then "${git[@]}" init --quiet "$clone"; fi
"${git[@]}" -C "$clone" fetch --quiet "$root" HEAD
"${git[@]}" -C "$clone" reset --quiet --hard FETCH_HEAD
for path in "${with[@]}"; do
  mkdir -p "$(dirname "$clone/$path")"
  cp -a --no-target-directory "$path" "$clone/$path"
done
chown -R --reference="$system$home" "$clone"

# The first process of the new process namespace; all others end with it, and so do the mounts.
enter() {
  mount --bind "$system" "$system"
  mount -t proc proc "$system/proc"
  mount -t sysfs -o ro sysfs "$system/sys"
  mount -t tmpfs -o mode=1777 tmpfs "$system/dev/shm"
  mount -t devpts -o newinstance,ptmxmode=0666,mode=620,gid=5 devpts "$system/dev/pts"
  if [[ -d $shared ]]; then
    mkdir -p "$system$home/shared"
    mount --bind -o ro "$shared" "$system$home/shared"
  fi
  # Unlike chroot, this permits the namespaces in which Chromium runs its pages.
  cd "$system"
  pivot_root . mnt
  umount --lazy /mnt
  cd "$home/flatland"
  setpriv --reuid="$user" --regid="$user" --init-groups env -i "${environment[@]}" "$@"
}
shared=$(realpath -m "${FLATLAND_SHARED_DIR:-$root/../shared}")
environment=(HOME="$home" USER="$user" LOGNAME="$user" SHELL=/bin/bash LANG=C.UTF-8 TERM="${TERM:-dumb}"
  PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin)
while IFS= read -r variable; do
  environment+=("$variable=${!variable}")
done < <(compgen -e | grep -iE '^((https?|no)_proxy|PIP_(.*INDEX_URL|TRUSTED_HOST|DEFAULT_TIMEOUT))$')

# In the background, since a trap is run only after a foreground command has ended. A background command of a script
# ignores SIGINT, which all programs in the system would inherit.
env --default-signal=INT,QUIT unshare --mount --pid --fork --kill-child \
  bash -euc "$(declare -p system home shared user environment; declare -f enter)"$'\nenter "$@"' -- "$@" <&0 &
trap 'kill -KILL $!' HUP INT TERM
wait $!
