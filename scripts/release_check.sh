#!/usr/bin/env bash
# Checks what a release into the ROS index asks for: rosdep finds all dependencies as packages of
# Ubuntu 24.04, bloom makes Debian packages of each package, and each file says whose it is and under
# which licence. The index is the part of it that is kept in test/ros_index/: no network is asked.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly FOLDER=$PWD/test/ros_index
readonly INDEX=file://${FOLDER// /%20}
readonly PACKAGES=(tri_glide_interfaces tri_glide_ruckig tri_glide_kinematics)
readonly OUT=$PWD/out/release

# Nothing of ROS that is sourced here may answer in place of the index.
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH PYTHONPATH ROS_DISTRO ROS_PACKAGE_PATH

tools=.venv/release
if [ "$(cat "$tools/made_from" 2>/dev/null)" != "$(cat requirements-release.txt)" ]; then
    rm -rf "$tools"
    .venv/bin/python -m venv "$tools"
    "$tools/bin/python" -m pip install --quiet --disable-pip-version-check -r requirements-release.txt
    cp requirements-release.txt "$tools/made_from"
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/sources" "$work/src"
echo "yaml $INDEX/rosdep.yaml" >"$work/sources/kept.list"
export PATH=$PWD/$tools/bin:$PATH HOME=$work ROS_HOME=$work/ros ROSDEP_SOURCE_PATH=$work/sources
export ROSDISTRO_INDEX_URL=$INDEX/index-v4.yaml
export http_proxy=http://127.0.0.1:9 https_proxy=http://127.0.0.1:9 # whatever asks a network fails

reuse lint --quiet || { reuse lint && exit 1; }
echo "release-check: each file has a copyright and a licence"

# As bloom is given them: each package alone.
git ls-files -z --cached --others --exclude-standard |
    while IFS= read -r -d '' file; do [ ! -e "$file" ] || printf '%s\0' "$file"; done |
    tar --null --files-from=- --create --file=- | (mkdir "$work/clone" && tar --extract --file=- --directory="$work/clone")

rm -rf "$OUT"
for distribution in jazzy kilted; do
    rosdep update --rosdistro "$distribution" >"$work/log" 2>&1 || { cat "$work/log" && exit 1; }
    (cd "$work/clone" && rosdep install --from-paths . tri_glide_* --ignore-src -y --simulate \
        --rosdistro "$distribution" --os ubuntu:noble) >"$work/log" 2>&1 || { cat "$work/log" && exit 1; }
    if grep -q pip "$work/log"; then cat "$work/log" && exit 1; fi
    echo "release-check: $distribution: rosdep installs $(grep -c apt-get "$work/log") packages, none by pip"
    for package in "${PACKAGES[@]}"; do
        folder=$work/$distribution/$package
        mkdir -p "$folder"
        source=$work/clone
        [ "$package" = tri_glide_kinematics ] || source=$work/clone/$package
        cp -r "$source/." "$folder"
        (cd "$folder" && bloom-generate rosdebian --ros-distro "$distribution" --os-name ubuntu \
            --os-version noble) >"$work/log" 2>&1 </dev/null || { cat "$work/log" && exit 1; }
        mkdir -p "$OUT/$distribution"
        cp -r "$folder/debian" "$OUT/$distribution/$package"
        echo "release-check: $distribution: $(sed -n 's/^Package: //p' "$folder/debian/control") $(
            sed -n '1s/.*(\(.*\)).*/\1/p' "$folder/debian/changelog")"
    done
done
echo "release-check: the files for Debian are in out/release/"
