#compdef kilotwin
# Completion of kilotwin for zsh. Commands and options are those that --help lists.
_kilotwin() {
  local program=$words[1] command=$words[2]
  if (( CURRENT == 2 )); then
    local -a commands
    commands=(${(f)"$($program --help 2>/dev/null |
      awk '/^Subcommands:/ { on = 1; next } /^$/ { on = 0 } on { name = $1; sub(/^ *[^ ]+ */, ""); print name ":" $0 }')"})
    _describe command commands
    compadd -- --help --version
  elif [[ $words[CURRENT] == -* ]]; then
    local -a options
    options=(${(f)"$($program $command --help 2>/dev/null | grep -oE '^ +-[^ ]+' | tr -s ' ,' '\n\n' | grep -- -)"})
    compadd -a options
  elif [[ $words[CURRENT-1] == --mode ]]; then
    compadd -- local federated
  else
    _files
  fi
}
_kilotwin "$@"
