# SPDX-License-Identifier: MIT
# Completion for bash of sonard, sonard-mavlink, sonard-web and the tools beside them: the options that --help names.

_sonard_options() {
    COMPREPLY=()
    [[ $2 == -* ]] || return 0
    mapfile -t COMPREPLY < <(compgen -W "$("$1" --help 2> /dev/null |
        sed -nE 's/^ +(-[a-z]), (--[a-z-]+).*/\1 \2/p; s/^ +(--[a-z-]+).*/\1/p')" -- "$2")
}
complete -o default -F _sonard_options sonard sonard-mavlink sonard-web sonard-import sonard-poses sonard-report sonard-rosbag sonard-tune
