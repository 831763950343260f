#!/usr/bin/env bash
# usage: commands_listed_test.sh KILOTWIN SOURCES CMAKE BUILD
# `cmake --install` brings manual pages and completion of shells, and they contain every command with its options. Completion for zsh
# and fish is tested where these are installed. Status 77: help2man is not installed.
set -euo pipefail
program=$1 sources=$2 cmake=$3 build=$4
command -v help2man >/dev/null || { echo "no help2man here: scripts/setup --package"; exit 77; }
scratch=$(mktemp -d "${TMPDIR:-/tmp}/kilotwin-commands-XXXXXX")
trap 'rm -rf "$scratch"' EXIT
fail() {
  echo "FAILED: $1"
  exit 1
}

# The commands are those that the sources register.
mapfile -t commands < <(find "$sources/clients/cli" -name '*.cpp' -exec cat {} + | tr '\n' ' ' |
  grep -oE 'add_subcommand\( *"[a-z0-9]+"' | cut -d '"' -f 2 | sort -u)
[ "${#commands[@]}" -ge 20 ] || fail "the sources name only ${#commands[@]} commands"

"$cmake" --install "$build" --prefix "$scratch/prefix" --component shell >"$scratch/log" || { cat "$scratch/log"; fail "cmake --install"; }
share=$scratch/prefix/share
for command in "${commands[@]}"; do
  page=$share/man/man1/kilotwin-$command.1
  [ -s "$page" ] || fail "no manual page of kilotwin $command"
  # A command whose program is missing prints no options.
  grep -q '\\-\\-help' "$page" || fail "the manual page of kilotwin $command has no options"
done

# The completion needs one function of the package bash-completion, which here takes the words as they are.
# shellcheck disable=SC2034 # the completion uses them
_init_completion() {
  words=("${COMP_WORDS[@]}") cword=$COMP_CWORD
  cur=${words[cword]} prev=${words[cword - 1]}
}
# shellcheck source=/dev/null
source "$share/bash-completion/completions/kilotwin"
completed() { # WORD...: what completes the last of them
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
  _kilotwin "$program" 2>/dev/null
  printf '%s\n' "${COMPREPLY[@]}"
}
listed=$(completed kilotwin "")
for command in "${commands[@]}"; do
  grep -qx -- "$command" <<<"$listed" || fail "kilotwin $command is not completed"
  grep -qx -- --help <<<"$(completed kilotwin "$command" --he)" || fail "options of kilotwin $command are not completed"
done

# The completion of zsh runs in its line editor; here the functions that take completions print them.
in_zsh() { # WORD...: what completes the last of them
  # shellcheck disable=SC2016
  zsh -f -c '
    compadd() { [[ $1 == -a ]] && print -l -- ${(P)2} || print -l -- $@ }
    _describe() { print -l -- ${(P)2} }
    _files() { print FILES }
    words=("${@:2}") CURRENT=$(($# - 1))
    source "$1"' zsh "$share/zsh/site-functions/_kilotwin" "$@"
}
if command -v zsh >/dev/null; then
  listed=$(in_zsh "$program" "" | cut -d : -f 1)
  for command in "${commands[@]}"; do
    grep -qx -- "$command" <<<"$listed" || fail "zsh does not complete kilotwin $command"
    grep -qx -- --help <<<"$(in_zsh "$program" "$command" --he)" || fail "zsh does not complete options of kilotwin $command"
  done
  grep -qx federated <<<"$(in_zsh "$program" run --mode "")" || fail "zsh does not complete --mode"
  grep -qx FILES <<<"$(in_zsh "$program" run "")" || fail "zsh does not complete files"
fi

in_fish() { # LINE: what completes it
  PATH="$(dirname "$program"):$PATH" HOME=$scratch fish --no-config -c "source '$share/fish/vendor_completions.d/kilotwin.fish'; complete -C '$1'" |
    cut -f 1
}
if command -v fish >/dev/null; then
  listed=$(in_fish "kilotwin ")
  for command in "${commands[@]}"; do
    grep -qx -- "$command" <<<"$listed" || fail "fish does not complete kilotwin $command"
  done
  grep -qx -- --partitions <<<"$(in_fish "kilotwin run --pa")" || fail "fish does not complete options"
  grep -qx federated <<<"$(in_fish "kilotwin run --mode ")" || fail "fish does not complete --mode"
fi
echo "${#commands[@]} commands have manual pages and are completed"
