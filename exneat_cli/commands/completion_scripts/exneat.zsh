#compdef exneat
# Completion of exneat for zsh: eval "$(exneat completion zsh)"
_exneat() {
    local -a found
    found=("${(@f)$(${words[1]} completion zsh "${(@Q)words[1,CURRENT]}" 2>/dev/null)}")
    found=(${found:#})
    compadd -S '' -- ${(M)found:#*[=/]}
    compadd -- ${found:#*[=/]}
}
(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }
compdef _exneat exneat
