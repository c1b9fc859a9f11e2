# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
#
# What all runs have in common: ROS domain, where ros2 finds the package, pictures without a screen.
# Read by .venv/bin/activate (bash, zsh, sh), and so by the Makefile's commands, and by the tests;
# VIRTUAL_ENV names the environment. What is set already stays as it is.

_dmp_cpg_ros_default () {  # name, value
    if eval "[ -z \"\${$1:-}\" ]"; then
        export "$1=$2"
        _dmp_cpg_ros_undo="${_dmp_cpg_ros_undo:-} unset $1;"
    fi
}

_dmp_cpg_ros_remove () {  # name of a list of folders, entry
    eval "$1=\"\$(printf %s \":\${$1:-}:\" | sed \"s|:$2:|:|g; s|^:||; s|:\\\$||\")\""
    eval "[ -n \"\$$1\" ] || unset $1"
}

_dmp_cpg_ros_prepend () {  # name of a list of folders, entry
    _dmp_cpg_ros_remove "$1" "$2"
    eval "export $1=\"$2\${$1:+:\$$1}\""
    # Only this entry: a ROS 2 that is sourced later is to stay.
    _dmp_cpg_ros_undo="${_dmp_cpg_ros_undo:-} _dmp_cpg_ros_remove $1 '$2';"
}

_dmp_cpg_ros_restore () {  # called by deactivate
    eval "${_dmp_cpg_ros_undo:-}"
    unset _dmp_cpg_ros_undo
    unset -f _dmp_cpg_ros_default _dmp_cpg_ros_remove _dmp_cpg_ros_prepend _dmp_cpg_ros_restore
}

# The runs see only this machine, on a domain that nobody else has by default.
_dmp_cpg_ros_default ROS_DOMAIN_ID 87
_dmp_cpg_ros_default ROS_AUTOMATIC_DISCOVERY_RANGE LOCALHOST
# The matrices are small: threads cost more than they save, several times as much on busy cores.
_dmp_cpg_ros_default OPENBLAS_NUM_THREADS 1
# Without a screen: pictures offscreen, figures to files.
if [ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then
    _dmp_cpg_ros_default MUJOCO_GL egl
    _dmp_cpg_ros_default MPLBACKEND Agg
fi
# The ROS wheels do not name their prefix; a sourced ROS 2 names its own only.
_dmp_cpg_ros_prepend AMENT_PREFIX_PATH "$VIRTUAL_ENV"
if [ -e "$VIRTUAL_ENV/.dependencies-sourced" ]; then
    # The environment's own packages come before those of the sourced workspaces.
    _dmp_cpg_ros_prepend PYTHONPATH "$(echo "$VIRTUAL_ENV"/lib/python3*/site-packages)"
    [ -n "${ROS_DISTRO:-}" ] ||
        echo 'dmp_cpg_ros: .venv was made with a sourced ROS 2; source it here, too' >&2
elif [ -n "${ROS_DISTRO:-}" ] && [ -e "$VIRTUAL_ENV/.dependencies-wheels" ]; then
    echo 'dmp_cpg_ros: .venv was made without ROS 2; for the sourced one, run make install' >&2
fi
