#!/usr/bin/env bash
# Builds the wheel into a folder, out/ if none is named. The same files give the same bytes, in each folder
# and at each time: so files get one time, one set of rights, and no company from an earlier build.
set -euo pipefail
folder=$(realpath -m "${1:-out}")
cd "$(dirname "${BASH_SOURCE[0]}")/.."

umask 022
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
tar --create --mode=u=rwX,go=rX --exclude=__pycache__ pyproject.toml setup.py setup.cfg package.xml LICENSE \
    config tri_glide_kinematics | tar --extract --directory "$tree"
# The environment may have the setuptools that pyproject.toml names; if not, pip gets it.
isolation=()
if grep -q "\"setuptools==$(python -c 'import setuptools; print(setuptools.__version__)' 2>/dev/null)\"" pyproject.toml; then
    isolation=(--no-build-isolation)
fi
export SOURCE_DATE_EPOCH=315532800 # 1980, where the time of a zip file begins
python -m pip wheel --quiet --disable-pip-version-check --no-deps "${isolation[@]}" --wheel-dir "$folder" "$tree"
