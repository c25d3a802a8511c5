#!/usr/bin/env bash
# Runs a target of make, `test` if none is named, with the versions of constraints-jazzy.txt: those of
# a real Jazzy machine. This needs an environment of its own, which is made in a copy of the tree, .jazzy/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly COPY=.jazzy

# Of these versions there are wheels for Python 3.10 and 3.11 only. Without one of them, the exit code is
# 77, as in other test programs: left out.
find_python() {
    local candidate
    for candidate in ${PYTHON:+"$PYTHON"} python3.11 python3.10 python3; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info[:2] not in ((3, 10), (3, 11)))' \
            >/dev/null 2>&1; then
            printf '%s\n' "$candidate"
            return
        fi
    done
    printf 'test_jazzy: error: no Python 3.10 or 3.11 found; name one with PYTHON=...\n' >&2
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
        sed -i -E "s/^${package}(==[^;[]+)?\$/${version}/I; s/^${package}==[^;]+;/${version};/I" "$1"
    done < <(grep -E '^[A-Za-z]' constraints-jazzy.txt)
}

python=$(find_python)
copy_tree
pin "$COPY/constraints.txt"
pin "$COPY/requirements.txt"
export PYTHON=$python
make --directory="$COPY" --no-print-directory env
(cd "$COPY" && scripts/build_ruckig.sh)
exec make --directory="$COPY" --no-print-directory "${@:-test}"
