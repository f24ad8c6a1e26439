# Bash completion of ordo. Commands, options and names come from the program itself: from its --help and from `ordo list`.

# Names that `ordo list WHAT` prints under a title.
_ordo_names() { # PROGRAM WHAT TITLE
    "$1" list "$2" 2>/dev/null | awk -v title="^$3" '/^[^ ]/ { on = $0 ~ title } on && /^  [^ ]/ { print $1 }'
}

# Keys of a case with the index of the first of several tables, as --set takes them: grid.size=, material.0.young=
_ordo_keys() { # PROGRAM
    "$1" list input 2>/dev/null | awk -F '`' '
        /^## Top level/ { table = "" }
        /^## `\[\[/ { gsub(/[][]/, "", $2); table = $2 ".0." }
        /^## `\[[^[]/ { gsub(/[][]/, "", $2); table = $2 "." }
        /^\| `[a-z]/ { print table $2 "=" }'
}

_ordo()
{
    local ordo=$1 current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
    local command='' help words='' files='' folders='' head=''
    COMPREPLY=()
    ((COMP_CWORD == 1)) || command=${COMP_WORDS[1]}
    # shellcheck disable=SC2086  # no word without a command
    help=$("$ordo" $command --help 2>/dev/null) || return 0

    if [[ $current == -* ]]; then
        words=$(grep -oE '^  (-h,)?--[a-z-]+' <<<"$help" | grep -oE -- '--.*')
    elif [[ -z $command ]]; then
        words=$(awk '/^  [a-z]/ { print $1 }' <<<"$help")
    elif [[ $previous == --* ]] && grep -qE "^  $previous [A-Z]+[ :]" <<<"$help "; then
        case $previous in
        --method) words=$(_ordo_names "$ordo" methods Presets) ;;
        --material) words=$(_ordo_names "$ordo" materials Materials) ;;
        --path) words=$(sed -nE 's/^  --path .*, or (.*)$/\1/p' <<<"$help" | tr -d ,) files='*.csv' ;;
        --restart) words=latest files='*.h5' ;;
        --json) files='*' ;;
        --output | --data | --figures) folders=yes ;;
        --set) [[ $command != run && $command != check ]] || words=$(_ordo_keys "$ordo") ;;
        esac
    else
        case $command in
        run | check) files='*.toml' ;;
        list) words=$(sed -nE 's/^  what .*\{(.*)\}.*/\1/p' <<<"$help" | tr , ' ') ;;
        verify) words=$(_ordo_names "$ordo" cases Verification) ;;
        drive) words=$(_ordo_names "$ordo" materials Materials) ;;
        esac
    fi

    [[ $previous != --method || $current != *,* ]] || head=${current%,*},
    mapfile -t COMPREPLY < <(
        compgen -P "$head" -W "$words" -- "${current#"$head"}"
        [[ -z $files ]] || compgen -f -X "!$files" -- "$current"
        [[ -z $files$folders ]] || compgen -d -- "$current"
    )
    [[ -z $files$folders ]] || compopt -o filenames 2>/dev/null
    [[ $previous != --set ]] || compopt -o nospace 2>/dev/null
    return 0
}
complete -F _ordo ordo
