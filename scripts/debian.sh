# Sourced by scripts/test: runs a script of this tree in another Debian release.
# shellcheck shell=bash
#
# Settings, all optional:
#   RAYMORTAR_ROOTS    where the Debian roots are kept (/var/cache/raymortar)
#   RAYMORTAR_MIRROR   Debian mirror (http://deb.debian.org/debian)

# make_root SUITE DIR: complete or not at all
make_root() {
  local mirror=${RAYMORTAR_MIRROR:-http://deb.debian.org/debian} log=$2.log
  [[ ! -e $2/etc/debian_version ]] || return 0
  command -v debootstrap >/dev/null || apt_install debootstrap
  note "Making a Debian $1 root in $2 (log: $log)"
  rm -rf "$2.partial"
  if ! debootstrap --variant=minbase "$1" "$2.partial" "$mirror" >"$log" 2>&1
  then
    tail -n 20 "$log" >&2
    fail "debootstrap could not make the Debian $1 root from $mirror"
  fi
  # A root that is lost is made again: no need to wait for the disk
  echo force-unsafe-io >"$2.partial/etc/dpkg/dpkg.cfg.d/raymortar"
  mv "$2.partial" "$2"
}

# In a mount namespace of its own, where the mounts end with the run: nothing
# to undo, and removing the root can never reach the source tree through it.
# shellcheck disable=SC2016
enter='
  root=$1 tree=$2
  shift 2
  mkdir -p "$root$tree"
  for mounted in /proc /sys /dev; do
    mount --rbind "$mounted" "$root$mounted" || exit 125
  done
  mount --bind "$tree" "$root$tree" || exit 125
  exec chroot "$root" env -i "$@"'

# namespace COMMAND...: in a mount namespace; inside a chroot / is no mount
# point, and its propagation cannot be changed
namespace() {
  local propagation
  for propagation in private unchanged; do
    if unshare --mount --propagation "$propagation" true 2>/dev/null; then
      unshare --mount --propagation "$propagation" "$@"
      return
    fi
  done
  fail "this machine does not let root mount file systems (a container?)," \
    "which a Debian root needs: allow it (docker run --privileged)"
}

# run_in_debian SUITE COMMAND...
run_in_debian() {
  local suite=$1 root lock name status=0
  local settings=(PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
    HOME=/root LANG=C.UTF-8)
  shift
  case $suite in
  bookworm | trixie | sid) ;;
  *) fail "--debian takes bookworm, trixie or sid, not '$suite'" ;;
  esac
  ((EUID == 0)) || fail "--debian needs root: sudo $SOURCE/scripts/test ..."
  root=${RAYMORTAR_ROOTS:-/var/cache/raymortar}/debian-$suite
  mkdir -p "${root%/*}"
  exec {lock}>"$root.lock"
  flock "$lock"
  make_root "$suite" "$root"
  exec {lock}>&-
  for name in resolv.conf hosts; do
    [[ ! -e /etc/$name ]] || cp -L "/etc/$name" "$root/etc/$name"
  done
  # Mirrors of sid that lag carry a release file that has expired
  [[ $suite != sid ]] || printf 'Acquire::Check-Valid-Until "false";\n' \
    >"$root/etc/apt/apt.conf.d/80raymortar"
  for name in TERM RAYMORTAR_JOBS OMP_NUM_THREADS PYTEST_ADDOPTS http_proxy \
    https_proxy no_proxy; do
    [[ -z ${!name:-} ]] || settings+=("$name=${!name}")
  done
  namespace bash -c "$enter" enter "$root" "$SOURCE" "${settings[@]}" "$@" ||
    status=$?
  ((status != 125)) || fail "could not mount /proc, /sys, /dev or the source" \
    "tree in $root (a container?): docker run needs --privileged"
  return "$status"
}
