#!/usr/bin/env bash
# Makes a site of all pages in out/docs, without a warning, and checks its links.
#
# Sphinx and what it needs lie in a folder of their own, as they ask for older versions of packages
# that .venv has, too.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly TOOLS=.venv/docs SITE=out/docs
set +eu
# shellcheck source=/dev/null
. ./env.sh
set -eu

if ! cmp -s requirements-docs.txt "$TOOLS/made_from"; then
    echo "docs: installing Sphinx"
    rm -rf "$TOOLS"
    if ! python -m pip install --disable-pip-version-check --target "$TOOLS" \
        -r requirements-docs.txt >.venv/docs.log 2>&1; then
        grep -E '^ERROR' .venv/docs.log >&2 || true
        echo "docs: error: Sphinx could not be installed (the whole log is .venv/docs.log)" >&2
        exit 1
    fi
    cp requirements-docs.txt "$TOOLS/made_from"
fi
rm -rf "$SITE"
PYTHONPATH="$PWD/$TOOLS${PYTHONPATH:+:$PYTHONPATH}" python -m sphinx \
    -E -b html -c docs -W --keep-going -n -q -j auto -d out/docs_read . "$SITE"
python docs/check_site.py "$SITE"
echo "docs: $SITE/index.html"
