#!/usr/bin/env bash
# Measures which lines of the package `make test` runs, those of nodes as processes included.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

export COVERAGE_FILE=$PWD/out/coverage/data COVERAGE_RCFILE=$PWD/setup.cfg
unset PYTHONDONTWRITEBYTECODE
# From Python 3.12 on a line that was seen costs nothing any more. Before that nodes are slowed down.
if python -c 'import sys; sys.exit(sys.version_info < (3, 12))'; then export COVERAGE_CORE=sysmon; fi

rm -rf out/coverage
mkdir -p out/coverage
status=0
tests() { python -m coverage run -m pytest "$@" || status=$?; }
if [ $# -gt 0 ]; then
    tests "$@"
else
    tests -n auto -m "not nodes and not alone"
    tests -n 3 --dist loadfile --no-loadscope-reorder -m "nodes and not alone"
    tests -m alone
fi
python -m coverage combine --quiet
python -m coverage report || status=$?
exit "$status"
