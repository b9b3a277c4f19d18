"""The settings of the core, whose fields, checks and documentation are declared in C++."""

from __future__ import annotations

import dataclasses
import inspect
import typing
from typing import Any, NamedTuple

from sdnn._core import (
    AcrobotConfig as AcrobotConfig,
    ActorCriticConfig as ActorCriticConfig,
    Controller as Controller,
    FuzzyQLearningConfig as FuzzyQLearningConfig,
    FuzzyRulesConfig as FuzzyRulesConfig,
    GoalScheduleConfig as GoalScheduleConfig,
    LinearSDNNConfig as LinearSDNNConfig,
    ProtocolConfig as ProtocolConfig,
    QLambdaConfig as QLambdaConfig,
    QLearningConfig as QLearningConfig,
    RBFNetworkConfig as RBFNetworkConfig,
    SDNNCConfig as SDNNCConfig,
    SensorConfig as SensorConfig,
)
from sdnn.support.arguments import explains_names


class Field(NamedTuple):
    """A setting of the core, in the order in which C++ describes it (bind_config.hpp)."""

    name: str
    hint: str  # its type as Python source, such as "float | None"
    default: Any
    doc: str
    low: float  # smallest value, -inf without a limit
    high: float  # largest value, inf without a limit
    excludes_low: bool  # whether values must be above `low`

    @property
    def type(self) -> Any:
        """The type of the setting's values."""
        return eval(self.hint, {"typing": typing})  # the text is one of the core's, not a user's


def fields_of(config_class: object) -> tuple[Field, ...]:
    """Return the settings of a class of the core, or none for any other class.

    >>> [field.name for field in fields_of(FuzzyRulesConfig)]
    ['n_inputs', 'n_sets', 'n_actions', 'max_table_bytes']
    """
    return tuple(Field(*field) for field in getattr(config_class, "fields", ()))


def values_of(config: object) -> dict[str, object]:
    """Return the values of all settings by name, in types that JSON has."""
    return {field.name: getattr(config, field.name) for field in fields_of(type(config))}


def _make_dataclass(config_class: Any) -> None:
    """Add the attributes to a class of the core that functions of `dataclasses` need.

    So `dataclasses.replace`, ``help`` and editors know its settings. They are taken from a
    dataclass with the same fields, which is then dropped.
    """
    fields = [
        (field.name, field.type, dataclasses.field(default=field.default))
        for field in fields_of(config_class)
    ]
    name = config_class.__name__
    model = dataclasses.make_dataclass(name, fields, repr=False, eq=False, kw_only=True)
    signature = inspect.signature(model).replace(return_annotation=inspect.Signature.empty)
    config_class.__dataclass_fields__ = vars(model)["__dataclass_fields__"]
    config_class.__annotations__ = model.__annotations__
    config_class.__signature__ = signature
    explains_names()(config_class)


(WARM_UP,) = fields_of(Controller)  # the only setting of a controller itself
"""The number of steps of a warm-up, which agents and specifications share."""

# A list, since the loop's own variable is added to the names while they are read.
for _config_class in [value for name, value in vars().items() if name.endswith("Config")]:
    _make_dataclass(_config_class)
