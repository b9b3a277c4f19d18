"""Whether an environment is one that an agent was made for: spaces compared."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.environments.spaces import in_a_line, wholes_of
from sdnn.support.arguments import require
from sdnn.support.bounds import with_infinities

Observed: TypeAlias = gym.Space[Any] | gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]
"""An observation space, or an environment that has one."""

_WAYS_OUT = {
    "observation_space": "wrap env as in the training; where the units are the same, set"
    " agent.observation_space = env.observation_space (of a vector, single_observation_space)",
    "action_space": "gymnasium.wrappers.RescaleAction(env, agent.action_space.low,"
    " agent.action_space.high) scales them; where the units are the same,"
    " gymnasium.wrappers.TransformAction(env, lambda action: action, agent.action_space)",
}
_ROUNDING = 1e-5
"""Largest difference of bounds, relative to the variable's larger one, that is rounding."""
_MOST_SHOWN = 3
"""Most variables with other bounds in a message."""


def spaces_of(
    observed: Observed, actions: gym.Space[Any] | None
) -> tuple[gym.Space[Any], gym.Space[Any]]:
    """Return the spaces of observations and actions: as given, or those of an environment."""
    has_spaces = _space_of(observed, "observation_space") is not None
    expected = "be a Gymnasium space, or an environment in its place such as gymnasium.make(id)"
    is_space = isinstance(observed, gym.Space) or (has_spaces and actions is None)
    require(is_space, "observation_space", expected, observed, TypeError)
    if isinstance(observed, gym.Space):
        require(isinstance(actions, gym.Space), "action_space", "be a Gymnasium space", actions,
                TypeError)  # fmt: skip
        return observed, actions  # type: ignore[return-value]
    return _space_of(observed, "observation_space"), _space_of(observed, "action_space")


def require_unbatched(observations: gym.Space[Any], actions: gym.Space[Any]) -> None:
    """Check that spaces are not the batched ones of a vector environment; ValueError if they are.

    These are a Box with rows of equal bounds, one for each environment, and as many actions.
    """
    n = observations.shape[0] if observations.shape else 0
    is_batched = _has_equal_rows(observations) and (
        _has_equal_rows(actions)
        or (isinstance(actions, gym.spaces.MultiDiscrete) and len(set(actions.nvec.flat)) == 1)
    )
    if is_batched and actions.shape is not None and actions.shape[0] == n:
        raise ValueError(
            "observation_space and action_space must be those of one environment, got those of"
            f" {n}: a vector has them as single_observation_space and single_action_space; where"
            " rows are no environments, gymnasium.wrappers.FlattenObservation flattens them"
        )


def _has_equal_rows(space: gym.Space[Any]) -> bool:
    if not isinstance(space, gym.spaces.Box) or len(space.shape) < 2:
        return False
    return bool((space.low == space.low[:1]).all() and (space.high == space.high[:1]).all())


def require_same_kind(agent: Any, env: Any) -> None:
    """Check that an agent can learn in an environment, or in each of a vector.

    Observations must be possible in the agent's space, and there must be as many actions. Bounds of
    a Box are the same but for rounding, as other bounds are other units; types are not compared.
    Where the agent's run scaled its observations, the environment must scale them, too. An
    environment without spaces is not checked, nor are bounds for an agent made in C++, whose spaces
    are its ranges.

    Raises
    ------
    ValueError
        If it does not fit.
    """
    scaling = getattr(agent, "scaling", None)
    if scaling is not None and not _is_unit(_space_of(env, "observation_space")):
        raise ValueError(
            "env must give observations scaled to [0, 1], as the agent's run did"
            f" ({scaling.words() or 'from which ranges is not known'}): UnitSensors(env,"
            " *agent.scaling.ends) of sdnn.environments, or Run.open(folder).config.environment"
            " of sdnn.runs"
        )
    for name, fits in (("observation_space", _can_observe), ("action_space", _acts_alike)):
        own, found = getattr(agent, name, None), _space_of(env, name)
        if own is not None and found is not None and not fits(own, found):
            raise ValueError(
                f"env must have the agent's {name}, {in_a_line(own)}, got {in_a_line(found)}"
            )
        if own is None or found is None or not getattr(agent, "has_bounds", True):
            continue
        if differences := list(_other_bounds(own, found)):
            more = ", ..." * (len(differences) > _MOST_SHOWN)
            raise ValueError(
                f"env must have the bounds of the agent's {name}, got others of"
                f" {', '.join(differences[:_MOST_SHOWN])}{more}; {_WAYS_OUT[name]}"
            )


def _other_bounds(own: Any, found: Any, part: str = "") -> Iterator[str]:
    """Yield the variables whose bounds differ, with both; the spaces fit otherwise."""
    if isinstance(own, gym.spaces.Dict | gym.spaces.Tuple):
        keys: Any = own.keys() if isinstance(own, gym.spaces.Dict) else range(len(own))
        for key in keys:
            yield from _other_bounds(own.spaces[key], found.spaces[key], f"{part}[{key!r}]")
    if not isinstance(own, gym.spaces.Box):
        return
    bounds, other = _bounds(own), _bounds(found)
    types = [np.dtype(space.dtype) for space in (own, found)]
    rounding = max(_ROUNDING, *(np.finfo(one).eps for one in types if one.kind == "f"), 0.0)
    size = np.where(np.isfinite(bounds), np.abs(bounds), 0.0).max(axis=1, keepdims=True)
    is_alike = (bounds == other) | np.isclose(bounds, other, rtol=0.0, atol=rounding * size)
    for i in np.flatnonzero(~is_alike.all(axis=1)):
        variable = f"variable {i}{part and f' of {part}'}"
        ranges = [f"{low:.6g} to {high:.6g}" for low, high in (other[i], bounds[i])]
        yield f"{variable} ({' instead of '.join(ranges)})"


def _bounds(space: Any) -> NDArray[np.float64]:
    """Return the lowest and the highest value of each variable, shape (n, 2)."""
    wholes = wholes_of(space)
    if wholes is not None:
        return np.array(wholes, np.float64).reshape(-1, 2)
    return np.stack([with_infinities(np.ravel(end)) for end in (space.low, space.high)], axis=1)


def require_same_variables(own: gym.Space[Any], found: gym.Space[Any]) -> None:
    """Check that a space can replace an agent's: all but bounds are the same; else ValueError."""
    expected = f"have the variables of {in_a_line(own)}"
    require(
        _can_observe(own, found) and _can_observe(found, own), "observation_space", expected, found
    )


def _space_of(env: Any, name: str) -> Any:
    return getattr(env, f"single_{name}", getattr(env, name, None))


def _is_unit(space: Any) -> bool:
    if not isinstance(space, gym.spaces.Box):
        return space is None
    return bool((space.low >= 0.0).all() and (space.high <= 1.0).all())


def _can_observe(own: gym.Space[Any], found: gym.Space[Any]) -> bool:
    if isinstance(own, gym.spaces.Dict) and isinstance(found, gym.spaces.Dict):
        return own.keys() == found.keys() and all(_can_observe(own[key], found[key]) for key in own)
    if isinstance(own, gym.spaces.Tuple) and isinstance(found, gym.spaces.Tuple):
        return len(own) == len(found) and all(map(_can_observe, own, found))
    found_wholes, own_wholes = wholes_of(found), wholes_of(own)
    if isinstance(own, gym.spaces.Box):
        has_numbers = isinstance(found, gym.spaces.Box) or found_wholes is not None
        return has_numbers and own.shape == found.shape
    if own.shape != found.shape or found_wholes is None or own_wholes is None:
        return False
    pairs = zip(found_wholes, own_wholes, strict=True)
    return all(mine[0] <= one[0] and one[1] <= mine[1] for one, mine in pairs)


def _acts_alike(own: gym.Space[Any], found: gym.Space[Any]) -> bool:
    if isinstance(own, gym.spaces.Box) and isinstance(found, gym.spaces.Box):
        return own.low.size == found.low.size
    return wholes_of(own) is not None and wholes_of(own) == wholes_of(found)
