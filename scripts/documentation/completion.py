# SPDX-License-Identifier: Apache-2.0
"""Completion for bash, zsh and fish, made from the program's help: {path: text}.

A choice is completed by its words, a number by nothing, everything else by files: the help says which a value is.
"""
from documentation import program

NOTICE = "# SPDX-License-Identifier: Apache-2.0\n# Made by scripts/manual from the program's help.\n"
NUMBERS = {"INT", "UINT", "FLOAT", "NUMBER"}


def scripts():
    return {"bash/ecorche": bash(), "zsh/_ecorche": zsh(), "fish/ecorche.fish": fish()}


def shared():
    return [option for group in program.page(None).groups for option in group.options]


def of_command(name):
    own = [option for group in program.page(name).groups for option in group.options]
    names = {word for option in own for word in option.names}
    return own + [option for option in shared() if not names & set(option.names) and "--version" not in option.names]


def choices(option):
    """The words of a choice; None where the value is none."""
    return option.type.split("|") if "|" in option.type else None


def is_number(option):
    return option.type in NUMBERS


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def values_in_bash(options):
    """`case` branches: what follows an option."""
    out = []
    for option in options:
        if not option.type:
            continue
        if choices(option):
            does = f'compopt +o default; COMPREPLY=($(compgen -W "{" ".join(choices(option))}" -- "$current"))'
        else:
            does = ":" if not is_number(option) else "compopt +o default"
        out.append(f"        {' | '.join(option.names)}) {does}; return ;;")
    return out


def bash():
    names = program.subcommands()
    out = [NOTICE, "_ecorche() {", '  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command= word',
           '  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do', f"    case $word in {' | '.join(names)}) command=$word; break ;; esac", "  done",
           "  COMPREPLY=()", "  case $command in"]
    for name in ["", *names]:
        options = of_command(name) if name else shared()
        words = " ".join(word for option in options for word in option.names)
        out += [f"    {name or quoted('')})", "      case $previous in", *values_in_bash(options), "      esac"]
        if not name:
            out += ["      if [[ $current != -* ]]; then", "        compopt +o default", f'        COMPREPLY=($(compgen -W "{" ".join(names)}" -- "$current"))',
                    "        return", "      fi"]
        out += [f'      [[ $current != -* ]] || COMPREPLY=($(compgen -W "{words}" -- "$current")) ;;']
    out += ["  esac", "}", "# Where it has no answer, readline offers files.", "complete -o default -F _ecorche ecorche"]
    return "\n".join(out) + "\n"


def in_brackets(text):
    return text.replace("\\", "\\\\").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")


def zsh_spec(option):
    value = ""
    if option.type:
        action = f"({' '.join(choices(option))})" if choices(option) else "" if is_number(option) else "_files"
        value = f":{in_brackets('value' if choices(option) else option.type)}:{action or ' '}"
    return [quoted(f"*{name}[{in_brackets(option.text)}]{value}") for name in option.names]


def zsh():
    names = program.subcommands()
    out = ["#compdef ecorche", NOTICE, "_ecorche() {", "  local context state state_descr line", "  typeset -A opt_args", "  _arguments -C \\"]
    out += [f"    {spec} \\" for option in shared() for spec in zsh_spec(option)]
    out += ["    '1: :->command' '*:: :->arguments' && return", "  case $state in", "    command)", "      local -a commands=("]
    out += [f"        {quoted(name + ':' + words)}" for name, words in names.items()]
    out += ["      )", "      _describe command commands ;;", "    arguments)", "      case $line[1] in"]
    for name in names:
        specs = [spec for option in of_command(name) for spec in zsh_spec(option)]
        out += [f"        {name}) _arguments {' '.join(specs)} '*:file:_files' ;;"]
    out += ["      esac ;;", "  esac", "}", '[ "$funcstack[1]" = _ecorche ] && _ecorche "$@" || compdef _ecorche ecorche']
    return "\n".join(out) + "\n"


def fish_option(option, when):
    words = " ".join(f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in option.names)
    value = ""
    if choices(option):
        value = f" -x -a {quoted(' '.join(choices(option)))}"
    elif option.type:
        value = " -x" if is_number(option) else " -r -F"
    return f"complete -c ecorche -n {quoted(when)} {words}{value} -d {quoted(option.text)}"


def fish():
    names = program.subcommands()
    none = "__fish_use_subcommand"
    out = [NOTICE, f"complete -c ecorche -f -n {none}"]
    out += [f"complete -c ecorche -n {none} -a {name} -d {quoted(words)}" for name, words in names.items()]
    out += [fish_option(option, none) for option in shared()]
    for name in names:
        out += [fish_option(option, f"__fish_seen_subcommand_from {name}") for option in of_command(name)]
    return "\n".join(out) + "\n"
