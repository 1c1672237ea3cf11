# Completion of exneat for bash: eval "$(exneat completion bash)"
_exneat() {
    local line=${COMP_LINE:0:COMP_POINT} IFS=$'\n' before="" each quoted=""
    local word=${COMP_WORDS[COMP_CWORD]}
    # Within quotes bash does it itself.
    [[ $word == [\'\"]* ]] && quoted=yes
    COMPREPLY=()
    for each in $("$1" completion bash "$line" 2>/dev/null); do
        [[ -n $quoted ]] || printf -v each '%q' "$each"
        # bash completes what comes after the last "=", unless that is no end of words.
        [[ -z $quoted && $COMP_WORDBREAKS == *=* && $each == *=?* ]] && each=${each#*=}
        COMPREPLY+=("$each")
    done
    [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *[=/] ]] && compopt -o nospace
    return 0
}
complete -F _exneat exneat
