# A Debian of another release or processor in a folder; sourced after _env.sh by the scripts that test in one.
#
#   make_debian FOLDER SUITE PACKAGES [OPTION ...]   makes it with debootstrap, unless it is there
#   in_debian FOLDER [NAME=VALUE ...] COMMAND ...    runs a command in it, this repository at /ros_ik_pkg
#   test_numerics FOLDER NAME=VALUE PYTEST ARGUMENTS ...   makes an environment in it, and runs these tests there

# needs_programs PACKAGES PROGRAM ...: ends the script if it may not or cannot make a system.
needs_programs() {
    local program
    ((EUID == 0)) || fail "needs root, for debootstrap and chroot: sudo scripts/$(basename "$0")"
    for program in "${@:2}"; do
        command -v "$program" >/dev/null || fail "needs $program: apt install $1"
    done
}

make_debian() {
    local folder=$1 suite=$2 packages=$3
    [[ -e $folder/complete ]] && return
    say "making $folder: a Debian $suite, once"
    rm -rf "$folder"
    debootstrap "${@:4}" --variant=minbase --include="$packages,ca-certificates,libgomp1" "$suite" "$folder"
    mkdir -p "$folder/ros_ik_pkg"
    cp -L /etc/ssl/certs/ca-certificates.crt "$folder/etc/ssl/certs/" # those that this machine trusts
    cp -L /etc/resolv.conf "$folder/etc/"
    touch "$folder/complete"
}

# What it mounts ends with the command.
in_debian() {
    # shellcheck disable=SC2016 # the inner shell expands these
    unshare --mount --pid --fork -- bash -euc '
        mount --bind "$1" "$0/ros_ik_pkg"
        mount -t proc proc "$0/proc"
        mount --rbind /dev "$0/dev"
        exec chroot "$0" /usr/bin/env -i HOME=/root LANG=C.UTF-8 PATH=/usr/bin:/bin PYTHONDONTWRITEBYTECODE=1 \
            ROS_IK_VENV=/venv "${@:2}"
    ' "$1" "$root" "${@:2}"
}

test_numerics() {
    # shellcheck disable=SC2016
    in_debian "$1" "$2" bash -euc '
        . /ros_ik_pkg/scripts/_env.sh
        use_python test
        cd "$root"
        "$python" -c "import platform, numba, numpy, pinocchio
print(platform.machine(), platform.libc_ver(), \"Python\", platform.python_version(), \"numba\", numba.__version__,
      \"numpy\", numpy.__version__, \"pin\", pinocchio.__version__)"
        exec "$python" -m pytest -p no:cacheprovider "$@"
    ' pytest "${@:3}" --ignore=test/ik/test_bad_inputs.py # it needs ROS messages
}
