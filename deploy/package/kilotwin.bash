# Completion of kilotwin for bash. Commands and options are those that --help lists.
_kilotwin() {
  local cur prev words cword
  _init_completion || return
  local command=${words[1]-}
  if [[ $cword -eq 1 ]]; then
    local commands
    commands=$("$1" --help 2>/dev/null | awk '/^Subcommands:/ { on = 1; next } /^$/ { on = 0 } on { print $1 }')
    mapfile -t COMPREPLY < <(compgen -W "$commands --help --version" -- "$cur")
  elif [[ $cur == -* ]]; then
    local options
    options=$("$1" "$command" --help 2>/dev/null | grep -oE '^ +-[^ ]+' | tr -s ' ,' '\n\n')
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$cur")
  elif [[ $prev == --mode ]]; then
    mapfile -t COMPREPLY < <(compgen -W 'local federated' -- "$cur")
  else
    _filedir
  fi
}
complete -F _kilotwin kilotwin
