#!/usr/bin/env bash
# Runs a target of make, `test` if none is named, with the versions of constraints-DISTRIBUTION.txt:
#
#     scripts/test_distribution.sh DISTRIBUTION [TARGET...]
#
#   jazzy   what a real Jazzy machine has (Ubuntu 24.04), and ruckig as in the ROS index
#   kilted  the wheels of ROS 2 Kilted in place of those of Jazzy
#
# This needs an environment of its own, which is made in a copy of the tree, .DISTRIBUTION/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Of some versions there are wheels for these Pythons only.
declare -Ar PYTHONS=([jazzy]="3.11 3.10" [kilted]="3.13 3.12 3.11 3.10")

readonly DISTRIBUTION=${1:-}
shift || true
if [ -z "$DISTRIBUTION" ] || [ -z "${PYTHONS[$DISTRIBUTION]:-}" ]; then
    printf 'test_distribution: error: name one of: %s\n' "${!PYTHONS[*]}" >&2
    exit 2
fi
readonly COPY=.$DISTRIBUTION

# Without a Python that fits, the exit code is 77, as in other test programs: left out.
find_python() {
    local candidate version candidates
    read -ra candidates <<<"${PYTHONS[$DISTRIBUTION]}"
    for candidate in ${PYTHON:+"$PYTHON"} "${candidates[@]/#/python}" python3; do
        version=$("$candidate" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null) || continue
        if [[ " ${candidates[*]} " = *" $version "* ]]; then
            printf '%s\n' "$candidate"
            return
        fi
    done
    printf 'test_distribution: error: no Python of %s found; name one with PYTHON=...\n' \
        "${PYTHONS[$DISTRIBUTION]}" >&2
    exit 77
}

# The tree as it is here, without what other targets made.
copy_tree() {
    mkdir -p "$COPY"
    find "$COPY" -mindepth 1 -maxdepth 1 \
        ! -name .venv ! -name build ! -name install ! -name log -exec rm -rf {} +
    git ls-files -z --cached --others --exclude-standard |
        while IFS= read -r -d '' file; do [ ! -e "$file" ] || printf '%s\0' "$file"; done |
        tar --null --files-from=- --create --file=- | tar --extract --file=- --directory="$COPY"
}

# Puts each version into the place of the one that is pinned, if it is.
pin() { # pin FILE
    local version package
    while read -r version; do
        package=${version%%==*}
        sed -i -E "s/^$package(\[[a-z]+\])?(==[^;[]+)?\$/$package\1==${version#*==}/I; s/^$package==[^;]+;/$version;/I" "$1"
    done <versions
}

# Puts the packages that are named after this distribution into the place of those that are named after
# Jazzy. Each of the two has some that the other one lacks.
rename() {
    local package
    sed -i -E "s/^ros-jazzy-/ros-$DISTRIBUTION-/" requirements.txt
    for package in $(grep -oE "^ros-$DISTRIBUTION-[a-z-]+" requirements.txt); do
        grep -q "^$package==" versions || sed -i -E "/^$package(\[|=|\$)/d" requirements.txt
    done
    grep "^ros-$DISTRIBUTION-" versions | while read -r version; do
        grep -qE "^${version%%==*}(\[|=|\$)" requirements.txt || printf '%s\n' "$version" >>requirements.txt
    done
    sed -i "/^ros-jazzy-/d" constraints.txt
    while read -r version; do
        grep -qi "^${version%%==*}==" constraints.txt || printf '%s\n' "$version" >>constraints.txt
    done <versions
}

python=$(find_python)
copy_tree
cd "$COPY"
grep -E '^[A-Za-z]' "constraints-$DISTRIBUTION.txt" >versions
pin constraints.txt
if [ "$DISTRIBUTION" != jazzy ]; then
    rename
fi
pin requirements.txt
export PYTHON=$python
make --no-print-directory env
if [ "$DISTRIBUTION" = jazzy ]; then
    scripts/build_ruckig.sh
fi
exec make --no-print-directory "${@:-test}"
