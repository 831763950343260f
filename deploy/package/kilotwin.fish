# Completion of kilotwin for fish. Commands and options are those that --help lists.
function __kilotwin_commands
    set -l words (commandline -opc)
    $words[1] --help 2>/dev/null | awk '/^Subcommands:/ { on = 1; next } /^$/ { on = 0 } on { name = $1; sub(/^ *[^ ]+ */, ""); print name "\t" $0 }'
end
function __kilotwin_options
    set -l words (commandline -opc)
    $words[1] $words[2] --help 2>/dev/null | grep -oE '^ +-[^ ]+' | tr -s ' ,' '\n\n' | grep -- -
end
function __kilotwin_follows
    set -l words (commandline -opc)
    test $words[-1] = $argv[1]
end
complete -c kilotwin -n 'test (count (commandline -opc)) -eq 1' -f -a '(__kilotwin_commands)'
complete -c kilotwin -n 'test (count (commandline -opc)) -eq 1' -f -a '--help --version'
complete -c kilotwin -n 'test (count (commandline -opc)) -gt 1; and string match -q -- "-*" (commandline -ct)' -f -a '(__kilotwin_options)'
complete -c kilotwin -n '__kilotwin_follows --mode' -f -a 'local federated'
