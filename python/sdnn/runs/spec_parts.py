"""The tables of a run's specification: agent, protocol, budget and output."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from sdnn.runs.errors import ConfigError
from sdnn.runs.settings import Settings

__all__ = ["AgentSpec", "BudgetSpec", "OutputSpec", "ProtocolSpec"]

Count = Annotated[int, Meta(ge=1, le=2**53)]
Index = Annotated[int, Meta(ge=0)]
EpisodeCount = Annotated[int, Meta(ge=1, le=2**30)]
CountOrNone = Annotated[int, Meta(ge=0, le=2**53)]


class AgentSpec(Settings, frozen=True):
    """Who learns."""

    name: Annotated[
        str, Meta(description="The agent: `sdnn-c`, `rbf`, `fuzzy`, or one that was registered.")
    ] = "sdnn-c"
    preset: Annotated[
        str | None,
        Meta(
            description="Named settings of the agent `sdnn-c`: `paper`, `general`, `robust` or"
            " `small`. By default `paper` on the paper's acrobot, `general` in environments."
        ),
    ] = None
    observation_range: Annotated[
        Literal["adaptive"] | None,
        Meta(description="`adaptive`: ranges of the observed variables come from a warm-up."),
    ] = None
    angles: Annotated[
        tuple[Index, ...],
        Meta(description="Observed variables, from 0, that are angles: their ranges wrap around."),
    ] = ()
    angle_pairs: Annotated[
        Literal["none", "find"] | tuple[tuple[Index, Index], ...],
        Meta(
            description="Which cosines and sines of an angle become one input: pairs of observed"
            " variables, from 0, or those that the warm-up finds."
        ),
    ] = "none"
    warm_up_steps: Annotated[
        Annotated[int, Meta(ge=2, le=10**7)],
        Meta(description="Random steps before learning, where ranges are not known."),
    ] = 1000


class ProtocolSpec(Settings, frozen=True):
    """How it learns and is evaluated."""

    n_envs: Annotated[
        Annotated[int, Meta(ge=1, le=4096)],
        Meta(description="Environments to learn in, in turn; steps are counted over all."),
    ] = 1
    evaluate_every: Annotated[
        CountOrNone | None,
        Meta(
            description="Steps between evaluations; 0: none. By default 10,000, or none if"
            " `evaluate_every_episodes` is given."
        ),
    ] = None
    evaluate_every_episodes: Annotated[
        Count | None,
        Meta(
            description="Learning episodes between evaluations, instead of steps. By default 10 on"
            " the paper's acrobot."
        ),
    ] = None
    evaluation_episodes: Annotated[
        Annotated[int, Meta(ge=1, le=10**9)] | None,
        Meta(
            description="Greedy episodes in each evaluation. By default 10, on the paper's"
            " acrobot 1."
        ),
    ] = None
    limit_bootstraps: Annotated[
        bool,
        Meta(
            description="Whether the last transition before a time limit bootstraps, as one that"
            " goes on; else it counts as terminated."
        ),
    ] = True
    noisy_evaluations: Annotated[
        bool, Meta(description="Whether the sensors are as noisy in evaluations as in learning.")
    ] = True


class BudgetSpec(Settings, frozen=True):
    """How long it learns."""

    steps: Annotated[
        Count | None, Meta(description="Steps to learn. By default 200,000 in environments.")
    ] = None
    episodes: Annotated[
        EpisodeCount | None,
        Meta(
            description="Episodes to learn, instead of steps. By default 15,000 on the paper's"
            " acrobot."
        ),
    ] = None
    target_return: Annotated[
        float | None, Meta(description="Stop when an evaluation has this mean return.")
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.steps is not None and self.episodes is not None:
            raise ConfigError("episodes", "must not be given together with steps")


class OutputSpec(Settings, frozen=True):
    """What is written besides the rows; it changes none of them."""

    checkpoint_every: Annotated[Count, Meta(description="Steps between checkpoints.")] = 10_000
    tensorboard: Annotated[bool, Meta(description="Write the numbers for TensorBoard, too.")] = (
        False
    )
