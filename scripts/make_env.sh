#!/usr/bin/env bash
# Makes everything that running and testing need, and nothing when it is all there.
#
# Where a ROS 2 Jazzy or Kilted is sourced, it is used, and .venv only adds the Python modules that it
# lacks. Elsewhere .venv gets ROS 2 itself, from pinned wheels: Jazzy, unless requirements.txt names
# another one. Then colcon builds the workspace.
# PYTHON names the interpreter to use where the default one does not fit.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly STAMP=.venv/made_from        # what .venv was made from; missing while it is incomplete
readonly BUILD_STAMP=install/made_from
readonly LOG=.venv/install.log

say() { printf 'env: %s\n' "$*"; }
fail() {
    printf 'env: error: %s\n' "$*" >&2
    exit 1
}

need() { # need COMMAND WHERE-FROM
    command -v "$1" >/dev/null 2>&1 || fail "$1 is missing (on Debian and Ubuntu: sudo apt install $2)"
}

ros_is_sourced() {
    [[ "${ROS_DISTRO:-}" =~ ^(jazzy|kilted)$ ]] && python3 -c 'import rclpy' >/dev/null 2>&1
}

find_python() {
    local candidate
    for candidate in ${PYTHON:+"$PYTHON"} python3 python3.13 python3.12 python3.11 python3.10; do
        if "$candidate" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' \
            >/dev/null 2>&1; then
            printf '%s\n' "$candidate"
            return
        fi
        [ "$candidate" != "${PYTHON:-}" ] || fail "PYTHON=$PYTHON is not a Python 3.10 to 3.13"
    done
    fail "no Python 3.10 to 3.13 found: the wheels of ROS 2 exist for these only" \
        "(python3 is $(python3 --version 2>&1 || true)); name another one with PYTHON=..."
}

# The exported CMake files of the wheels name the include folders of the machine they come from.
correct_include_folders() {
    .venv/bin/python - <<'PYTHON'
import re, sys, sysconfig
from pathlib import Path

site = sysconfig.get_path("purelib")
# The wheels were made beside numpy 2; numpy 1 has its include folder elsewhere.
numpy = Path(site, "numpy", "_core" if Path(site, "numpy", "_core", "include").exists() else "core")
for path in Path(sys.prefix, "share").rglob("*.cmake"):
    text = path.read_text(encoding="utf-8")
    changed = re.sub(r"/opt/python/[^/;\"]+/include/python3\.\d+", sysconfig.get_path("include"), text)
    changed = re.sub(r"/opt/python/[^/;\"]+/lib/python3\.\d+/site-packages", site, changed)
    changed = changed.replace(f"{site}/numpy/_core/include", str(numpy / "include"))
    if changed != text:
        path.write_text(changed, encoding="utf-8")
PYTHON
}

install() { # install PIP-ARGUMENTS...
    local reason
    .venv/bin/python -m pip install --disable-pip-version-check --retries 2 "$@" >>"$LOG" 2>&1 && return
    if grep -q 'Retrying (' "$LOG"; then
        reason="the package index cannot be reached; is there a network?"
    else
        reason=$(grep -m 1 -E '^ERROR' "$LOG" | cut -c 1-300 || true)
    fi
    fail "the packages could not be installed: $reason (the whole log is $LOG)"
}

make_venv_from_wheels() {
    local python
    python=$(find_python)
    "$python" -c 'import ensurepip, venv' >/dev/null 2>&1 ||
        fail "$python has no venv module (on Debian and Ubuntu: sudo apt install python3-venv)"
    [ "$(uname -sm)" = "Linux x86_64" ] ||
        fail "the wheels of ROS 2 are for Linux x86_64 and this is $(uname -sm): install ROS 2 Jazzy or Kilted and source it"
    say "making .venv with $("$python" --version)"
    "$python" -m venv .venv
    say "installing ROS 2 and the tools from wheels (about 200 packages, 1 to 3 minutes)"
    install -r requirements.txt -c constraints.txt
    correct_include_folders
    LD_LIBRARY_PATH='' .venv/bin/python -c \
        'import ros_wheels_bootstrapper as wheels; print(wheels.get_ros_paths())' >.venv/library_path
    : >.venv/local_setup.sh # colcon looks for it in each prefix of AMENT_PREFIX_PATH
}

make_venv_beside_ros() {
    local module missing=()
    say "using the ROS 2 $ROS_DISTRO that is sourced; .venv adds what it lacks"
    python3 -m venv --system-site-packages .venv >/dev/null 2>&1 ||
        fail "python3 cannot make a venv (on Debian and Ubuntu: sudo apt install python3-venv)"
    for module in numpy ruckig matplotlib tqdm yaml pytest xdist hypothesis scipy domain_coordinator \
        viser websockets ruff mypy importlinter; do
        .venv/bin/python -c "import $module" >/dev/null 2>&1 || missing+=("$module")
    done
    missing=("${missing[@]/#yaml/PyYAML}")
    missing=("${missing[@]/#xdist/pytest-xdist}")
    missing=("${missing[@]/#domain_coordinator/ros-domain-coordinator}")
    missing=("${missing[@]/#importlinter/import-linter}")
    # The messages of ROS are compiled against its own numpy: that one has to stay.
    .venv/bin/python -c 'import numpy; print("numpy==" + numpy.__version__)' >.venv/numpy.txt 2>/dev/null || true
    if [ ${#missing[@]} -gt 0 ]; then
        say "installing ${missing[*]}"
        install -c .venv/numpy.txt "${missing[@]}"
    fi
}

files_of_the_build() {
    find package.xml setup.py setup.cfg resource config launch executables tri_glide_kinematics tri_glide_interfaces \
        -type f ! -name '*.pyc' -print0 | LC_ALL=C sort -z | xargs -0 sha256sum
}

hash_of() { sha256sum | cut -d ' ' -f 1; }

if LC_ALL=C grep -q '[^ -~]' <<<"$PWD"; then
    fail "the path $PWD has a character outside ASCII, with which the build of ROS messages fails: move the clone"
fi
if ros_is_sourced; then
    mode="beside $(python3 -c 'import rclpy; print(rclpy.__file__)')"
    need colcon python3-colcon-common-extensions
else
    mode=wheels
    if [ -n "${ROS_DISTRO:-}" ]; then
        say "ROS 2 $ROS_DISTRO is sourced, but Jazzy or Kilted is needed: using wheels"
    fi
fi
need g++ g++
need cmake cmake
need make make

wanted="$PWD $mode $(cat requirements.txt constraints.txt scripts/make_env.sh | hash_of)"
if [ "$(cat "$STAMP" 2>/dev/null)" != "$wanted" ]; then
    rm -rf .venv build install log
    mkdir .venv
    if [ "$mode" = wheels ]; then make_venv_from_wheels; else make_venv_beside_ros; fi
    # Of this package tests need the file of axe-core alone (MPL-2.0), not the browsers that it drives.
    install --no-deps axe-playwright-python==0.1.8
    printf '%s\n' "$wanted" >"$STAMP"
fi

built_from=$({ files_of_the_build; cat "$STAMP"; } | hash_of)
if [ "$(cat "$BUILD_STAMP" 2>/dev/null)" != "$built_from" ]; then
    say "building the workspace with colcon (the first time some minutes)"
    rm -f "$BUILD_STAMP"
    mkdir -p install # env.sh takes what is there
    # colcon removes no file that the package no longer has, and a folder hides a module of its name.
    rm -rf build/tri_glide_kinematics install/tri_glide_kinematics
    # Without byte code each start of a node compiles all modules; Python has to be allowed to write it.
    # shellcheck source=/dev/null
    # Without MAKEFLAGS colcon compiles one file after the other on a computer that is busy.
    # ruckig is in .venv: its library, of which tri_glide_ruckig makes a module, need not be here.
    if ! (set +eu; . ./env.sh && unset PYTHONDONTWRITEBYTECODE && MAKEFLAGS="-j$(nproc)" \
        colcon build --packages-ignore tri_glide_ruckig) \
        >.venv/build.log 2>&1; then
        tail -n 25 .venv/build.log >&2
        fail "colcon build failed (the whole log is .venv/build.log)"
    fi
    printf '%s\n' "$built_from" >"$BUILD_STAMP"
    say "ready: source env.sh"
fi
