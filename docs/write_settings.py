"""Write docs/reference/settings.md from the settings as they are declared."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sdnn.runs.spec_schema import CORE, spec_schema

PAGE = Path(__file__).parent / "reference" / "settings.md"

HEAD = """# Settings of a run

<!-- Written by docs/write_settings.py from the declarations of the settings. -->

The keys of files for `sdnn train --config FILE`, of `--set KEY=VALUE`, and of
[studies](../how-to/studies.md): type; default; meaning. `approximator.*` and `learning.*` are those
of the agent, with the paper's defaults, before a preset. `sdnn train --schema` prints JSON Schema.

A study without an environment is about the paper's acrobot: the agent is `sdnn-c` with the preset
`paper`, the budget 15,000 episodes, and every 10 episodes there is an evaluation of one episode.
"""


def page() -> str:
    """Return the page."""
    definitions = spec_schema()["$defs"]
    text = HEAD
    described: dict[str, str] = {}
    for table, found in definitions["RunSpec"]["properties"].items():
        text += f"\n## {table}\n\n{found['description']}\n"
        names = [kind.__name__ for kind in CORE.get(table, ())]
        names = names or [
            one["$ref"].rpartition("/")[2] for one in found.get("anyOf", [found]) if "$ref" in one
        ]
        for name in names:
            text += f"\n### {name}\n\n"
            text += "".join(entries(table, name, definitions[name]["properties"], described))
    return text


def entries(
    table: str,
    kind: str,
    properties: dict[str, Any],
    described: dict[str, str],
) -> Iterator[str]:
    """Write a line for each setting; what an earlier class has alike is named only."""
    same: dict[str, list[str]] = {}
    for name, found in properties.items():
        default = found.get("default")
        what = words(found) + ("" if default in (None, (), {}) else f"; `{default}`")
        text = found.get("description", "")
        first = described.setdefault(f"{name} {text}", kind)
        if described.setdefault(f"{name} {what} {text}", kind) != kind:
            same.setdefault(first, []).append(name)
        elif first != kind and len(text.split()) > 5:
            yield f"- **`{table}.{name}`** ({what}): As in {first}.\n"
        else:
            yield f"- **`{table}.{name}`** ({what}): {text}\n"
    for first, names in same.items():
        yield f"- As in {first}: {', '.join(f'`{name}`' for name in names)}\n"


def words(found: dict[str, Any]) -> str:
    """Write a type with its bounds, but for those that only guard against absurd numbers."""
    if "anyOf" in found:
        return ", ".join(words(one) for one in found["anyOf"] if one.get("type") != "null")
    if "enum" in found:
        return ", ".join(f"`{word}`" for word in found["enum"] if word is not None)
    text: str = found.get("type", "")
    limits = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<="}
    bounds = {sign: found[key] for key, sign in limits.items() if abs(found.get(key, 1e6)) < 1e6}
    return text + "".join(f" {sign} {bound:g}" for sign, bound in bounds.items())


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
