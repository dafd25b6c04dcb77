# SPDX-License-Identifier: MIT
# Completion of sonarctl for bash: asks sonarctl itself. A part behind = is a word of its own for bash.

_sonarctl() {
    local line=${COMP_LINE:0:COMP_POINT} candidate
    local -a words
    read -ra words <<< "$line"
    [[ $line == *[[:space:]] ]] && words+=("")
    local last=${words[-1]}
    COMPREPLY=()
    while IFS=$'\t' read -r candidate _; do
        [[ $last == *=* ]] && candidate=${candidate#"${last%%=*}="}
        [[ $candidate == *= ]] && compopt -o nospace
        COMPREPLY+=("$candidate")
    done < <("${words[0]}" complete -- "${words[@]:1}" 2> /dev/null)
}
complete -o default -F _sonarctl sonarctl
