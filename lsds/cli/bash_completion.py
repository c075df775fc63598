"""Completion in bash, which cuts words at '=', ':' and '@', where values of lsds go on."""

from __future__ import annotations

import os

from click.shell_completion import BashComplete, add_completion_class, split_arg_string

SCRIPT = """\
%(complete_func)s() {
    local line="${COMP_LINE:0:COMP_POINT}" word kept type value
    word="${line##*[[:space:]]}"
    # bash replaces only what follows the last of these characters: the rest of the word is left out of each reply.
    kept="${word%%"${word##*[=:@]}"}"
    # The values of --option=value come without the option.
    [[ "$kept" == --*=* ]] && kept="${kept#*=}"
    COMPREPLY=()
    while IFS=',' read -r type value; do
        case "$type" in
            dir) compopt -o dirnames ;;
            file) compopt -o default ;;
            plain)
                COMPREPLY+=("${value#"$kept"}")
                # A value that ends with one of these continues.
                [[ "$value" == *[.=:@] ]] && compopt -o nospace
                ;;
        esac
    done < <(env LSDS_COMP_LINE="$line" %(complete_var)s=bash_complete "$1")
    return 0
}

complete -o nosort -F %(complete_func)s %(prog_name)s
"""
"""The script that `lsds completion bash` prints. It hands over the whole line, not the words that bash made of it."""


class LineComplete(BashComplete):
    """Reads the command line itself, as the words of bash end at '='."""

    source_template = SCRIPT

    @staticmethod
    def _check_version() -> None:
        """Print the script on machines without bash, too."""

    def get_completion_args(self) -> tuple[list[str], str]:
        """Return the words before the cursor, and the one at it. A script of lsds 0.1 hands over bash's words."""
        line = os.environ.get("LSDS_COMP_LINE")
        if line is None:
            return super().get_completion_args()
        words = split_arg_string(line)[1:]
        incomplete = words.pop() if words and not line[-1].isspace() else ""
        return words, incomplete


def use() -> None:
    """Let click complete in bash with this script and class."""
    add_completion_class(LineComplete, "bash")
