# To be sourced (bash or zsh): puts the shell into the environment that `make env` made.
# Where .venv holds ROS 2 itself, it replaces whatever ROS the shell had.

if [ -n "${BASH_SOURCE:-}" ]; then
    _tri_glide_root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
    _tri_glide_setup=local_setup.bash
elif [ -n "${ZSH_VERSION:-}" ]; then
    _tri_glide_root=$(cd "$(dirname "${(%):-%x}")" && pwd)
    _tri_glide_setup=local_setup.zsh
else
    _tri_glide_root=$PWD
    _tri_glide_setup=local_setup.sh
fi

if [ ! -f "$_tri_glide_root/.venv/bin/activate" ]; then
    echo "env.sh: there is no environment yet: run 'make env' first" >&2
    return 1
fi

. "$_tri_glide_root/.venv/bin/activate"

if [ -f "$_tri_glide_root/.venv/library_path" ]; then
    # ROS 2 from wheels. The library path is set here because the wheels would otherwise start
    # every interpreter twice to set it.
    unset PYTHONPATH ROS_DISTRO
    export AMENT_PREFIX_PATH="$VIRTUAL_ENV" CMAKE_PREFIX_PATH="$VIRTUAL_ENV"
    LD_LIBRARY_PATH=$(cat "$_tri_glide_root/.venv/library_path")
    export LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
fi

if [ -f "$_tri_glide_root/install/$_tri_glide_setup" ]; then
    COLCON_CURRENT_PREFIX="$_tri_glide_root/install"
    # colcon's scripts do not quote the interpreter: it gets the one behind .venv's link, whose
    # path has no space where the clone's has one.
    COLCON_PYTHON_EXECUTABLE=$(readlink -f "$_tri_glide_root/.venv/bin/python")
    . "$_tri_glide_root/install/$_tri_glide_setup"
    unset COLCON_CURRENT_PREFIX COLCON_PYTHON_EXECUTABLE
fi

# Jazzy from wheels has no command `ros2`. This is what the documents use of it that needs no more.
_tri_glide_commands="$_tri_glide_root/install/tri_glide_kinematics/lib/tri_glide_kinematics"
if ! command -v ros2 >/dev/null 2>&1; then
    ros2() {
        if [ "${1:-}" != run ] || [ "${2:-}" != tri_glide_kinematics ] || [ -z "${3:-}" ]; then
            echo "ros2: without ROS 2 installed there is only" \
                "'ros2 run tri_glide_kinematics NAME'" >&2
            return 2
        fi
        _tri_glide_name=$3
        shift 3
        "$_tri_glide_commands/$_tri_glide_name" "$@"
    }
fi
unset _tri_glide_root _tri_glide_setup
