#!/usr/bin/env bash
# Builds the wheel, installs it into environments without ROS, one for each Python that is found, and runs
# the tests that need none. PYTHON names the interpreters, if not all; arguments go to pytest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly WORK=$PWD/.wheel
unset PYTHONPATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH ROS_DISTRO VIRTUAL_ENV

find_pythons() {
    local candidate
    for candidate in ${PYTHON:-python3.10 python3.11 python3.12 python3.13 python3.14}; do
        ! "$candidate" -c 'import ensurepip, venv' >/dev/null 2>&1 || printf '%s\n' "$candidate"
    done
}

# The tests without the package beside them, which would be taken for the installed one.
copy_tests() {
    rm -rf "$WORK/tree"
    mkdir -p "$WORK/tree"
    tar --create --exclude=__pycache__ setup.cfg package.xml config benchmarks test testing |
        tar --extract --directory "$WORK/tree"
}

build() {
    rm -rf "$WORK/made"
    # shellcheck source=/dev/null
    (set +eu && . ./env.sh && scripts/build_wheel.sh "$WORK/made")
}

build
copy_tests
found=0
for python in $(find_pythons); do
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    printf '\n== Python %s\n' "$version"
    found=$((found + 1))
    environment=$WORK/$version
    "$python" -m venv --clear "$environment"
    "$environment/bin/python" -m pip install --quiet --disable-pip-version-check -c constraints.txt \
        "$(echo "$WORK"/made/*.whl)[can,pictures,recordings,test]" pytest-xdist
    (cd "$WORK/tree" && PATH=$environment/bin:$PATH exec python -m pytest -p testing.without_ros -n auto \
        -m "not nodes and not alone" "$@")
done
if [ "$found" = 0 ]; then
    printf 'test_wheel: error: no Python 3.10 to 3.14 found; name one with PYTHON=...\n' >&2
    exit 1
fi
