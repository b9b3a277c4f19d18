"""A matrix of bad options, made from the commands: a new option is covered by itself.

A cell (a name, and a function that returns a fault) gives one bad text to one option or argument.
The command must end with exit code 2 and name it, end with exit code 1 and a message that has the
text (a missing file), or work.
"""

import contextlib
import functools
import os
import re
import tempfile
from pathlib import Path

from click import Argument, Context
from click.testing import CliRunner

from sdnn.cli import main

TEXTS = {
    "NaN": "nan", "inf": "inf", "-inf": "-inf", "-1": "-1", "0": "0", "0.5": "0.5",
    "2**63": str(2**63), "2**70": str(2**70), "400 digits": "9" * 400, "1e308": "1e308",
    "-1e308": "-1e308", "1e400": "1e400", "empty": "", "blank": " ", "a word": "abc",
    "None": "None", "true": "true", "list": "[1, 2]", "a line end": "a\nb",
    "name=value": "x=y", "dots": "..", "no folder": "no/such/place", "a colon": ":",
    "many letters": "a" * 5000,
}  # fmt: skip

STUDY = """
[study]
title = "Ties"
trials = 1
cases = ["s4"]

[base]
budget.episodes = 10

[axes]
learning.tie_rule = ["lowest"]
"""

COMMANDS = {
    "train": (["CartPole-v1"], ["--dry-run"]),
    "resume": (["run"], []),
    "evaluate": (["run"], ["--episodes=1"]),
    "export": (["run"], ["--c-header=agent.h"]),
    "inspect": (["run"], []),
    "plot": (["run"], []),
    "record": (["run", "out.gif"], ["--steps=2"]),
    "reproduce": (["a"], ["--dry-run", "--out=results"]),
    "sweep": (["study.toml"], ["--dry-run", "--out=results"]),
    "verify": (["run"], []),
}
"""Good arguments and options, with which the commands work and end soon."""

LEFT_OUT = {"bench"}
"""Commands without cells: all options of `bench` are flags, and it measures for a minute."""


@functools.cache
def run_folder():
    """Train a small agent, once in each process; return the folder of the finished run."""
    run = os.path.join(tempfile.mkdtemp(), "run")
    settings = ["n_pattern_units=20", "n_hidden_units=60", "n_active_units=20"]
    options = [f"--set=approximator.{setting}" for setting in settings]
    arguments = ["train", "MountainCar-v0", "--agent", "sdnn-c", "--steps", "60", *options]
    arguments += ["--evaluate-every", "60"]
    result = CliRunner().invoke(main, [*arguments, "--evaluation-episodes", "1", "--out", run])
    assert result.exit_code == 0, result.output
    return run


def parameters_of(command):
    """Return all parameters but the option for help."""
    parameters = main.commands[command].get_params(Context(main.commands[command]))
    return [parameter for parameter in parameters if parameter.name != "help"]


def command_cells(command):
    """Yield cells of every option and argument of a command; a flag gets the value 5 only."""
    for parameter in parameters_of(command):
        texts = {"a value": "5"} if getattr(parameter, "is_flag", False) else TEXTS
        for title, text in texts.items():
            name = parameter.opts[-1]
            yield f"sdnn {command} {name} {title}", _cell(command, parameter, text)


def arguments_of(command, parameter, text):
    """Return the good arguments and options, with the text as the value of one of them."""
    arguments, options = map(list, COMMANDS[command])
    if isinstance(parameter, Argument):
        positional = [other for other in parameters_of(command) if isinstance(other, Argument)]
        arguments[positional.index(parameter)] = text
    else:
        options.append(f"{parameter.opts[-1]}={text}")  # the last one counts
    return [*options, "--", *arguments]


def _cell(command, parameter, text):
    def run():
        source = run_folder()
        os.symlink(source, "run")
        Path("study.toml").write_text(STUDY)
        arguments = [command, *arguments_of(command, parameter, text)]
        result = CliRunner().invoke(main, arguments)
        return fault_of(result, parameter, text)

    return run


def fault_of(result, parameter, text):
    """Return what is wrong with how a command ended, or ""."""
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        return f"raised {type(result.exception).__name__}: {str(result.exception)[:200]}"
    if result.exit_code == 0:
        return "printed NaN" if "nan" in result.stdout.lower() and text != "nan" else ""
    message = result.stderr
    if result.exit_code not in (1, 2):
        return f"exit code {result.exit_code}: {message[-200:]}"
    if result.exit_code == 1:  # the file or run that the text names is missing
        is_clear = text[:50] in message or is_named(parameter, message)
        return "" if is_clear else f"printed {message[-200:]}"
    if not is_named(parameter, message):
        return f"did not name {parameter.opts}: {message[-200:]}"
    return "" if is_shown(text, message) else f"did not show the value: {message[-200:]}"


def is_named(parameter, message):
    """Return whether a message has an option, an argument, or the choices of an argument."""
    shown = parameter.metavar or parameter.name.upper()
    without_dashes = (option.strip("-") for option in parameter.opts)
    names = {*parameter.opts, *without_dashes, shown, shown.lower()}
    names |= {f"[{'|'.join(getattr(parameter.type, 'choices', ()))}]"} - {"[]"}
    return any(re.search(rf"(?<![\w-]){re.escape(name)}(?!\w)", message) for name in names)


def is_shown(text, message):
    """Return whether a message has an option's text or number, or says that none is possible."""
    if not text.strip() or re.search(r"\bneeds?\b|does not take a value", message):
        return True
    forms = {*text.split("="), repr(text), Path(text[:50]).stem}
    with contextlib.suppress(ValueError):
        forms.add(str(float(text)))
    return any(form[:50] in message for form in forms)
