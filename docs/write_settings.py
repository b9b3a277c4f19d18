"""Write docs/reference/settings.md from the settings as they are declared."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sdnn.runs.config_file import PAPER_ARGUMENTS, core_parts, spec_schema

PAGE = Path(__file__).parent / "reference" / "settings.md"

HEAD = """# Settings of a run

<!-- Written by docs/write_settings.py from the declarations of the settings. -->

The keys of files for `sdnn train --config FILE`, of `--set KEY=VALUE`, and of
[studies](../how-to/studies.md): default, range, meaning. `approximator.*` and `learning.*` are
those of the agent, with the paper's defaults, before a preset. `sdnn train --schema` has details.

In the cases of the paper the agent is by default `sdnn-c` with the preset `paper`, the budget
15,000 episodes, and every 10 episodes there is an evaluation of one episode.
"""
ASSUMPTION = re.compile(r" An assumption\b.*| \(section [^)]*\)")
NOT_IN_THE_PAPER = re.compile(r" Not in the paper[^.:]*(?:\.|: (\w))")
"""A remark that the page omits: docs/evidence/assumptions.md has the paper's settings."""
MOST_WORDS = 24
"""The limit for several sentences on a setting; `sdnn train --schema` has the others."""


def page() -> str:
    """Return the page."""
    definitions = spec_schema()["$defs"]
    text = HEAD
    described: dict[str, str] = {}
    for table, schema in definitions["RunSpec"]["properties"].items():
        text += f"\n## {table}\n\n{schema['description']}\n"
        names = [config_type.__name__ for config_type in core_parts().get(table, ())]
        names = names or [
            alternative["$ref"].rpartition("/")[2]
            for alternative in schema.get("anyOf", [schema])
            if "$ref" in alternative
        ]
        for name in names:
            text += f"\n### {name}\n\n" if len(names) > 1 else "\n"
            text += "".join(entries(table, name, definitions[name]["properties"], described))
    for argument, config in PAPER_ARGUMENTS.items():
        key, name = f"environment.kwargs.{argument}", config.__name__
        text += f"\n## {key}\n\nOf `sdnn/PaperAcrobot-v0`, the paper's acrobot.\n\n"
        text += "".join(entries(key, name, definitions[name]["properties"], described))
    return text


def entries(
    table: str,
    class_name: str,
    properties: dict[str, Any],
    described: dict[str, str],
) -> Iterator[str]:
    """Write a table with a row for each setting; what an earlier class has alike is named only."""
    yield "| Setting | Default, range | Meaning |\n|---|---|---|\n"
    same: dict[str, list[str]] = {}
    for name, schema in properties.items():
        what, text = default_and_range(schema), short(schema.get("description", ""))
        first = described.setdefault(f"{name} {text}", class_name)
        if described.setdefault(f"{name} {what} {text}", class_name) != class_name:
            same.setdefault(first, []).append(name)
        elif first != class_name and len(text.split()) > 5:
            yield f"| `{table}.{name}` | {what} | As in {first}. |\n"
        elif (twin := twin_of(name, properties)) and name.endswith("_1"):
            both = f"`{table}.{name}`, `{twin}`"
            yield f"| {both} | {what} | {text.replace('link 1', 'each link')} |\n"
        elif not twin:
            yield f"| `{table}.{name}` | {what} | {text} |\n"
    for first, names in same.items():
        yield f"| {', '.join(f'`{name}`' for name in names)} | | As in {first}. |\n"


def twin_of(name: str, properties: dict[str, Any]) -> str:
    """Return the setting that is the same of the other link, if there is one."""
    other = name[:-1] + {"1": "2", "2": "1"}.get(name[-1], "")
    mine, its = (
        {key: re.sub("[12]", "", f"{value}") for key, value in properties.get(setting, {}).items()}
        for setting in (name, other)
    )
    return other if other != name and mine == its else ""


def short(description: str) -> str:
    """Return the first sentences of a description, without what they say of the paper."""
    text = ASSUMPTION.sub("", description)
    text = NOT_IN_THE_PAPER.sub(lambda match: f" {(match[1] or '').upper()}".rstrip(), text)
    text, *more = re.split(r"(?<=\.) (?=[A-Z0-9])", text)
    for sentence in more:
        if len(f"{text} {sentence}".split()) > MOST_WORDS:
            break
        text += f" {sentence}"
    return text


def default_and_range(schema: dict[str, Any]) -> str:
    """Write a default and what else is allowed, but for bounds that go without saying."""
    default = schema.get("default")
    shown = [] if default in (None, (), {}) else [f"`{default}`"]
    for alternative in schema.get("anyOf", [schema]):
        if "enum" in alternative:
            shown += [f"`{word}`" for word in alternative["enum"] if word not in (None, default)]
        elif "exclusiveMinimum" not in alternative and alternative.get("maximum", 1e6) < 1e6:
            shown.append(f"{alternative['minimum']:g} to {alternative['maximum']:g}")
        elif alternative.get("type") != "null" and default in (None, (), {}):
            shown.append(alternative.get("type", ""))
    return ", ".join(shown)


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
