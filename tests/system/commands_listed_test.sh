#!/usr/bin/env bash
# usage: commands_listed_test.sh KILOTWIN SOURCES
# Manual pages and the completion of the shell contain every command with its options. Status 77: help2man is not installed.
set -euo pipefail
program=$1 sources=$2
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

"$sources/deploy/package/manual" "$program" "$scratch/man"
for command in "${commands[@]}"; do
  page=$scratch/man/kilotwin-$command.1
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
source "$sources/deploy/package/kilotwin.bash"
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
echo "${#commands[@]} commands have manual pages and are completed"
