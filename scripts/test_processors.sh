#!/usr/bin/env bash
# Runs all tests that start no nodes as on other processors. The last bits of a result depend on the
# processor: OpenBLAS, numpy and the C library choose their code by it. Arguments go to pytest.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Everything that numpy uses on this processor beyond what each one has.
features=$(python - <<'PYTHON'
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

print(" ".join(name for name in __cpu_dispatch__ if __cpu_features__[name]))
PYTHON
) || exit

failed=()
run() { # run NAME VARIABLE=VALUE... -- PYTEST-ARGUMENTS...
    local name=$1 settings=()
    shift
    while [ "$1" != -- ]; do
        settings+=("$1")
        shift
    done
    shift
    printf '\n== %s\n' "$name"
    env "${settings[@]}" python -m pytest --quiet -n auto -m "not nodes" "$@" || failed+=("$name")
}

for kind in Haswell SkylakeX Zen Prescott; do
    run "$kind" OPENBLAS_CORETYPE="$kind" -- "$@"
done
run "no vector units" OPENBLAS_CORETYPE=Prescott NPY_DISABLE_CPU_FEATURES="$features" \
    GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA -- "$@"

if [ ${#failed[@]} -gt 0 ]; then
    printf '\ntests failed as on: %s\n' "$(IFS=,; echo "${failed[*]}")" >&2
    exit 1
fi
