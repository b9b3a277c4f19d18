"""Specifications of runs by the names of their options."""

import msgspec

from sdnn.cli.common import KEYS
from sdnn.runs import RunSpec

# "seed" is the key "seed", "steps" is "budget.steps"; "agent" is the name of the agent.
_KEYS = {"agent" if key == "agent.name" else key.rpartition(".")[2]: key for key in KEYS}
_EXCLUDED = {"steps": "episodes", "episodes": "steps"}  # a budget has one of them


def run_spec(base=None, settings=None, environment=None, **options):
    """Return the specification ``base``, or one of sdnn-c, with other tables and options."""
    values = {"agent": {"name": "sdnn-c"}} if base is None else base.values()
    if environment is not None:
        values["environment"] = msgspec.to_builtins(environment)
    for table, changes in (settings or {}).items():
        values[table] = {**values.get(table, {}), **changes}
    for name, value in options.items():
        if name in _EXCLUDED and value is not None:
            values.get("budget", {}).pop(_EXCLUDED[name], None)
        table, _, key = _KEYS[name].rpartition(".")
        if table:
            values[table] = {**values.get(table, {}), key: value}
        else:
            values[key] = value
    return RunSpec.from_values(values)
