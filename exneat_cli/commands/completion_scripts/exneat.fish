# Completion of exneat for fish: exneat completion fish > ~/.config/fish/completions/exneat.fish
complete -c exneat -f -a '(exneat completion fish (commandline -opc) (commandline -ct) 2>/dev/null)'
