# Shared by the scripts beside it; sourced, not run.
# shellcheck shell=bash
#
# Finds or installs what raymortar needs, builds it, and sets the environment
# its programs run in. One build directory per system (build/debian-12,
# build/debian-13, ...), so that several can share one source tree.
#
# Settings, all optional:
#   RAYMORTAR_PYTHON   interpreter that has dolfinx (default: searched for)
#   RAYMORTAR_JOBS     parallel compiler jobs (default: number of cores)
set -euo pipefail

SOURCE=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

TOOL_PACKAGES=(g++ cmake ninja-build ccache pkgconf libeigen3-dev pybind11-dev
  libgtest-dev libopenmpi-dev openmpi-bin libopenblas0)
# PETSc's headers come with python3-dolfinx-real, in the version it was built on
PYTHON_PACKAGES=(python3-dolfinx python3-dolfinx-real python3-petsc4py-real
  python3-gmsh python3-h5py python3-matplotlib python3-pytest python3-pytest-xdist
  python3-scipy)
# Installed where apt can; scripts/test names some
OPTIONAL_PACKAGES=()

note() { printf -- '-- %s\n' "$*" >&2; }

fail() {
  printf 'error: %s\n' "$@" >&2
  exit 1
}

# The comment at the head of the script that runs
usage() {
  sed -n '2,/^[^#]/{s/^# \{0,1\}//p}' "$0"
}

# debian-12, debian-13, debian-unstable, ...
system_name() {
  local ID=linux VERSION_ID=
  # shellcheck source=/dev/null
  [[ ! -r /etc/os-release ]] || . /etc/os-release
  printf '%s-%s' "$ID" "${VERSION_ID:-unstable}"
}

BUILD=$SOURCE/build/$(system_name)
PREFIX=$BUILD/prefix
INVENTORY=

# Leaves the packages that are absent in MISSING and the versions of the
# others, by which a stale build is known, in INVENTORY
find_missing_packages() {
  local wanted=("${TOOL_PACKAGES[@]}") name version status
  local -A installed=()
  # An interpreter of the user's own brings its own dolfinx and PETSc
  if [[ -z ${RAYMORTAR_PYTHON:-} ]]; then
    wanted+=("${PYTHON_PACKAGES[@]}")
    for name in "${OPTIONAL_PACKAGES[@]}"; do
      if is_installed "$name" || { can_be_root && apt_can_install "$name"; }; then
        wanted+=("$name")
      fi
    done
  fi
  while read -r name version status; do
    [[ $status == installed ]] || continue
    installed[$name]=1
    INVENTORY+="$name $version"$'\n'
  done < <(dpkg-query -W -f '${Package} ${Version} ${db:Status-Status}\n' \
    "${wanted[@]}" 2>/dev/null || true)
  MISSING=()
  for name in "${wanted[@]}"; do
    [[ -n ${installed[$name]:-} ]] || MISSING+=("$name")
  done
}

# Runs a command as root where that needs no password
as_root() {
  if ((EUID == 0)); then
    "$@"
  else
    sudo -n "$@"
  fi
}

is_installed() {
  [[ $(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null) == installed ]]
}

# Whether apt knows a package and all that it needs, without installing it
apt_can_install() {
  apt-get -q -s install --no-install-recommends "$1" >/dev/null 2>&1
}

can_be_root() {
  ((EUID == 0)) || { command -v sudo >/dev/null && sudo -n true 2>/dev/null; }
}

# apt_install PACKAGE...: with the list of packages brought up to date first
apt_install() {
  local log
  local apt=(env DEBIAN_FRONTEND=noninteractive apt-get -q
    -o DPkg::Lock::Timeout=600)
  log=$(mktemp)
  note "Installing with apt: $*"
  if ! { as_root "${apt[@]}" update &&
    as_root "${apt[@]}" install -y --no-install-recommends "$@"; } \
    >"$log" 2>&1 </dev/null; then
    cat "$log" >&2
    rm -f "$log"
    fail "apt could not install: $*"
  fi
  rm -f "$log"
}

# Without dpkg nothing can be installed for the user: name what is not there
check_commands() {
  local command absent=()
  for command in c++ cmake ninja pkg-config mpirun; do
    command -v "$command" >/dev/null || absent+=("$command")
  done
  ((${#absent[@]} == 0)) || fail "missing commands: ${absent[*]}" \
    "also needed: Eigen, pybind11, GoogleTest, PETSc (real), dolfinx, pytest"
}

check_blas() {
  local library
  for library in /usr/lib/*/libblas.so.3; do
    [[ $(readlink -f "$library") == */blas/libblas.so.* ]] || continue
    note "The reference BLAS is in use: direct solves take about 4 times" \
      "longer. To change: update-alternatives --config" \
      "libblas.so.3-$(basename "$(dirname "$library")")"
  done
}

ensure_packages() {
  if ! command -v dpkg-query >/dev/null; then
    check_commands
    return
  fi
  find_missing_packages
  ((${#MISSING[@]})) || return 0
  can_be_root || fail "missing packages: ${MISSING[*]}" \
    "install them with:" "  apt-get update && apt-get install \
--no-install-recommends ${MISSING[*]}" "as root (or allow sudo)"
  apt_install "${MISSING[@]}"
  INVENTORY=
  find_missing_packages
  # Optional ones, which apt may know of only since its list was brought up to date
  if ((${#MISSING[@]})); then
    apt_install "${MISSING[@]}"
    INVENTORY=
    find_missing_packages
  fi
}

# Prints the interpreter to use: real dolfinx, not the first python3 there is
find_python() {
  local candidates=(python3 /usr/bin/python3 /usr/bin/python3.[0-9]
    /usr/bin/python3.[0-9][0-9])
  local candidate path reason report=()
  [[ -z ${RAYMORTAR_PYTHON:-} ]] || candidates=("$RAYMORTAR_PYTHON")
  for candidate in "${candidates[@]}"; do
    path=$(command -v "$candidate") || continue
    if reason=$("$path" - 2>&1 <<'PYTHON'
import sys

try:
    import numpy
    from petsc4py import PETSc

    import dolfinx  # noqa: F401
except ImportError as error:
    sys.exit(str(error))
if not numpy.issubdtype(PETSc.ScalarType, numpy.floating):
    sys.exit("its PETSc is complex; raymortar needs the real one (PETSC_DIR)")
PYTHON
    ); then
      printf '%s' "$path"
      return
    fi
    report+=("  $path: ${reason##*$'\n'}")
  done
  fail "no Python interpreter here has a real-valued dolfinx:" "${report[@]}" \
    "name one with RAYMORTAR_PYTHON=/path/to/python3"
}

# logged COMMAND...: quiet on success, everything it said on failure
logged() {
  "$@" >"$BUILD/build.log" 2>&1 </dev/null && return
  cat "$BUILD/build.log" >&2
  fail "failed: $*"
}

# tell_progress LOCK: every 20 s the last line of the build's log, as "[23/76] clip.cpp"
tell_progress() {
  local begin=$SECONDS lock=$1
  # It holds neither the lock nor the user's pipes, which its sleep outlives
  exec {lock}>&-
  while sleep 20 >/dev/null 2>&1 && kill -0 $$ 2>/dev/null; do
    note "$(tail -n 1 "$BUILD/build.log" | sed 's:Building .*/::; s:unity_::; s:\(_cxx\)\?\.c[xp]*\.o$::')," \
      "after $((SECONDS - begin)) s"
  done
}

# configure STAMP: STAMP says what the build was configured for
configure() {
  local python options=()
  rm -f "$BUILD/stamp"
  check_blas
  python=$(find_python)
  ! command -v ccache >/dev/null ||
    options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  note "Configuring ${BUILD#"$SOURCE"/} with $python"
  # Package versions changed, so nothing an earlier run found is to be trusted
  rm -rf "$BUILD/CMakeCache.txt" "$BUILD/CMakeFiles"
  logged cmake -S "$SOURCE" -B "$BUILD" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_INSTALL_PREFIX="$PREFIX" -DPython_EXECUTABLE="$python" \
    "${options[@]}"
  printf '%s' "$python" >"$BUILD/interpreter"
  printf '%s' "$1" >"$BUILD/stamp"
}

# Modules that are gone from the source tree must not be importable any more
remove_stale_modules() {
  local file package=$PREFIX/python
  [[ -d $package ]] || return 0
  while IFS= read -r file; do
    [[ -e $SOURCE/python/${file#"$package"/} ]] || rm -f "$file"
  done < <(find "$package" -name '*.py')
}

# build TARGET: configures, compiles and installs what is out of date, and
# leaves the interpreter in PYTHON
build() {
  local stamp jobs=${RAYMORTAR_JOBS:-$(nproc)} lock progress
  mkdir -p "$BUILD"
  exec {lock}>"$BUILD/lock"
  flock "$lock"
  stamp="$SOURCE ${RAYMORTAR_PYTHON:-}"$'\n'"$INVENTORY"
  if [[ ! -e $BUILD/stamp || $(<"$BUILD/stamp") != "${stamp%$'\n'}" ]]; then
    configure "$stamp"
    note "Compiling, $jobs at a time, 3 to 10 minutes on two cores" \
      "(output: ${BUILD#"$SOURCE"/}/build.log)"
  fi
  tell_progress "$lock" &
  progress=$!
  (logged ninja -C "$BUILD" -j "$jobs" "$1") || {
    kill "$progress"
    exit 1
  }
  kill "$progress"
  remove_stale_modules
  logged cmake --install "$BUILD"
  exec {lock}>&-
  # shellcheck disable=SC2034 # the scripts use it
  PYTHON=$(<"$BUILD/interpreter")
}

# run_environment RANKS: what the programs see, unless the user set it already
run_environment() {
  local cores threads
  cores=$(nproc)
  threads=$((cores / $1 > 1 ? cores / $1 : 1))
  # The package, and the meshes of demos and tests
  export PYTHONPATH=$PREFIX/python:$SOURCE${PYTHONPATH:+:$PYTHONPATH}
  export OMP_NUM_THREADS=${OMP_NUM_THREADS:-$threads}
  export OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-$threads}
  export MPLBACKEND=${MPLBACKEND:-Agg}
  # Forms compiled once serve every later run of the same system
  export XDG_CACHE_HOME=${XDG_CACHE_HOME:-$BUILD/cache}
  # Open MPI: allow root, and be silent about what containers lack
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  export PRTE_ALLOW_RUN_AS_ROOT=1 PRTE_ALLOW_RUN_AS_ROOT_CONFIRM=1
  export OMPI_MCA_btl_vader_single_copy_mechanism=none
  export OMPI_MCA_btl_sm_single_copy_mechanism=none
  export OMPI_MCA_btl_base_warn_component_unused=0
  # One machine: shared memory does. The networks' components complain where
  # there is none, or cost a second.
  export OMPI_MCA_btl=${OMPI_MCA_btl:-^tcp,ofi,uct,openib}
  # A single rank starts no daemon, which looks its host's name up (5 s where
  # no one knows it)
  export OMPI_MCA_ess_singleton_isolated=${OMPI_MCA_ess_singleton_isolated:-1}
}

# launch RANKS COMMAND...: under mpirun for more than one rank
launch() {
  local ranks=$1 options=() version
  shift
  run_environment "$ranks"
  if ((ranks > 1)); then
    # More ranks than cores may be asked for, and threads may use every core.
    # Options, as the names of the settings differ between Open MPI 4, 5 and 6.
    version=$(mpirun --version)
    [[ $version != *"Open MPI"* ]] ||
      options=(--map-by :OVERSUBSCRIBE --bind-to none)
    # Version 4 says at length that a rank has failed, which the rank has said;
    # later ones know no such option
    [[ $version != *"(Open MPI) 4."* ]] || options+=(--quiet)
    # Ranks that wait for others must leave them the cores
    ((ranks <= $(nproc))) || export OMPI_MCA_mpi_yield_when_idle=1
    mpirun "${options[@]}" -n "$ranks" "$@"
  else
    "$@"
  fi
}

# Sets RANKS from a leading "-n RANKS" and REST to the arguments after it
take_ranks() {
  RANKS=1
  if [[ ${1:-} == -n ]]; then
    RANKS=${2:-}
    [[ $RANKS =~ ^[1-9][0-9]*$ ]] ||
      fail "-n takes a number of ranks, not '$RANKS'"
    shift 2
  fi
  REST=("$@")
}
