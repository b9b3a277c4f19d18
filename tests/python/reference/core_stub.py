"""Prints the type stub of the compiled core: python tests/python/reference/core_stub.py.

pybind11-stubgen writes the stub. Its types of configurations, constructors and enumerations are
replaced by narrower ones, and what differs from run to run is removed.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import sdnn._core


def _typed_config(match: re.Match[str]) -> str:
    """Return the stub of a configuration with types, from the attribute ``fields`` of its class.

    The match is the stub of the class as the tool writes it; its group is the name of the class.
    """
    text, class_name = match[0], match[1]
    hints = {name: hint for name, hint, *_ in getattr(sdnn._core, class_name).fields}
    for name, hint in hints.items():
        text = re.sub(rf"(    def {name}\(self\)) -> .*:", rf"\1 -> {hint}:", text)
    parameters = []
    for name, hint in hints.items():  # a tuple may be given as any sequence
        hint = hint.replace("tuple[", "collections.abc.Sequence[").replace(", ...]", "]")
        parameters.append(f"{name}: {hint} = ...")
    signature = f"def __init__(self, *, {', '.join(parameters)})"
    text = re.sub(r"def __init__\(self, .*\)", signature, text)
    text = text.replace(f"**kwargs) -> {class_name}", f"**changes: typing.Any) -> {class_name}")
    text = re.sub(r"    fields: .*", "    fields: typing.ClassVar[tuple[typing.Any, ...]]", text)
    fields = "    __dataclass_fields__: typing.ClassVar[dict[str, typing.Any]]\n"
    return text.replace("    fields: ", fields + "    fields: ", 1)


def generate() -> str:
    """Return the text that ``python/sdnn/_core.pyi`` should have for the installed core."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pybind11_stubgen", "sdnn._core", "--exit-code"]
        command += ["--enum-class-locations", ".+:sdnn._core"]
        process = subprocess.run(
            [*command, "-o", folder], capture_output=True, text=True, check=False
        )
        if process.returncode != 0:
            raise RuntimeError(process.stdout + process.stderr)
        text = (Path(folder) / "sdnn" / "_core.pyi").read_text()
    # The tool adds an __all__ that the module does not have, and the value of its version.
    if not hasattr(sdnn._core, "__all__"):
        text = re.sub(r"^__all__.*?\]\n", "", text, flags=re.MULTILINE | re.DOTALL)
    # It writes members of enumerations in a form that type checkers no longer accept.
    text = re.sub(
        r"^    (\w+): typing\.ClassVar\[((?!tuple)\w+)\]$",
        lambda line: f"    {line[1]} = {getattr(sdnn._core, line[2])[line[1]].value}",
        text,
        flags=re.MULTILINE,
    )
    text = text.replace("    @classmethod\n    def __new__(cls, value):\n        ...\n", "")
    text = re.sub(
        r"^class (\w+Config):\n(?:(?:    .*)?\n)+", _typed_config, text, flags=re.MULTILINE
    )
    return re.sub(r"^__version__: str = .*$", "__version__: str", text, flags=re.MULTILINE)


if __name__ == "__main__":
    sys.stdout.write(generate())
