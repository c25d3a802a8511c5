#!/usr/bin/env bash
# Builds ruckig 0.9.2, the version of the ROS index, from its sources, and tri_glide_ruckig on it as colcon
# does, into the .venv of the folder it is called in: that is what a Jazzy machine without pip has.
set -euo pipefail

readonly VERSION=0.9.2
readonly BINDING=$PWD/tri_glide_ruckig
readonly VENV=$PWD/.venv
readonly WORK=$VENV/ruckig

python=$VENV/bin/python
site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
suffix=$("$python" -c 'import sysconfig; print(sysconfig.get_config_var("EXT_SUFFIX"))')
module=$site/tri_glide_ruckig$suffix
for file in "$BINDING/src/module.cpp" "$BINDING/CMakeLists.txt"; do
    [ "$module" -nt "$file" ] || old=yes
done
[ -n "${old:-}" ] || exit 0

mkdir -p "$WORK"
"$python" -m pip install --quiet --disable-pip-version-check pybind11==3.0.1
if [ ! -e "$WORK/ruckig-$VERSION" ]; then
    # Its build tools would be installed first, and cmake compiled: only the sources are wanted.
    "$python" -m pip download --quiet --disable-pip-version-check --no-deps --no-build-isolation \
        --no-binary ruckig --dest "$WORK" "ruckig==$VERSION"
    tar --extract --gzip --file "$WORK/ruckig-$VERSION.tar.gz" --directory "$WORK"
    touch "$WORK/ruckig-$VERSION/package.xml" # it is to be installed, and is in the repository only
fi

build() { # build SOURCES NAME CMAKE-ARGUMENTS...
    cmake -S "$1" -B "$WORK/build/$2" -DCMAKE_BUILD_TYPE=Release "${@:3}" >"$WORK/$2.log"
    cmake --build "$WORK/build/$2" --parallel --target install >>"$WORK/$2.log"
}

# The library is a part of the module, so that the module finds it wherever it is copied to.
build "$WORK/ruckig-$VERSION" ruckig -DCMAKE_INSTALL_PREFIX="$WORK/library" -DBUILD_SHARED_LIBS=OFF \
    -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DBUILD_EXAMPLES=OFF -DBUILD_TESTS=OFF
pybind11=$("$python" -c 'import pybind11; print(pybind11.get_cmake_dir())')
build "$BINDING" tri_glide_ruckig -DCMAKE_INSTALL_PREFIX="$WORK/module" -DBUILD_TESTING=OFF \
    "-DCMAKE_PREFIX_PATH=$VENV;$WORK/library;$pybind11" \
    "-DPython3_ROOT_DIR=$VENV" -DPython3_FIND_VIRTUALENV=ONLY
cp "$WORK/module/${site#"$VENV/"}/tri_glide_ruckig$suffix" "$module"
