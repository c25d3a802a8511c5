#!/usr/bin/env bash
# Builds ruckig 0.9.2, the version of the ROS index, from its sources, and tri_glide_ruckig on it, into
# the .venv of the folder it is called in: that is what a Jazzy machine without pip has.
set -euo pipefail

readonly VERSION=0.9.2
readonly BINDING=$PWD/tri_glide_ruckig
readonly WORK=$PWD/.venv/ruckig

python=$PWD/.venv/bin/python
suffix=$("$python" -c 'import sysconfig; print(sysconfig.get_config_var("EXT_SUFFIX"))')
module=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/tri_glide_ruckig$suffix
[ ! -e "$module" ] || [ "$BINDING/src/module.cpp" -nt "$module" ] || exit 0

mkdir -p "$WORK"
"$python" -m pip install --quiet --disable-pip-version-check pybind11==3.0.1
if [ ! -e "$WORK/ruckig-$VERSION" ]; then
    # Its build tools would be installed first, and cmake compiled: only the sources are wanted.
    "$python" -m pip download --quiet --disable-pip-version-check --no-deps --no-build-isolation \
        --no-binary ruckig --dest "$WORK" "ruckig==$VERSION"
    tar --extract --gzip --file "$WORK/ruckig-$VERSION.tar.gz" --directory "$WORK"
fi
# As ruckig's own CMakeLists.txt builds its library.
pybind11=$("$python" -c 'import pybind11; print(pybind11.get_include())')
headers=$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
g++ -O2 -DNDEBUG -std=c++17 -shared -fPIC -fvisibility=hidden -I "$pybind11" -I "$headers" \
    -I "$WORK/ruckig-$VERSION/include" "$BINDING/src/module.cpp" \
    "$WORK/ruckig-$VERSION"/src/ruckig/{brake,position-step1,position-step2,velocity-step1,velocity-step2}.cpp \
    -o "$module"
