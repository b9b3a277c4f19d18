"""Agents as C headers, for small processors, and images of what they learn there."""

from __future__ import annotations

import warnings
import zlib
from pathlib import Path
from typing import Any

from sdnn.agents import SDNNActorCritic, SDNNQLambda, SDNNQLearning
from sdnn.agents.agent import AnyAgent
from sdnn.agents.base import BaseAgent
from sdnn.export.actor_critic import ActorCriticLearner, ActorCriticWriter
from sdnn.export.q_lambda import QLambdaLearner, QLambdaWriter
from sdnn.export.sdnn_c import SDNNCLearner, SDNNCWriter
from sdnn.export.text import header_file, require_c_name
from sdnn.export.writer import CHeader, follows_ranges
from sdnn.support.arguments import flag, require, shown
from sdnn.support.files import write_whole

_WRITERS: dict[type, tuple[Any, Any]] = {
    SDNNQLearning: (SDNNCWriter, SDNNCLearner),
    SDNNQLambda: (QLambdaWriter, QLambdaLearner),
    SDNNActorCritic: (ActorCriticWriter, ActorCriticLearner),
}
"""The classes that write an agent's header: its greedy policy, and the agent that learns."""


def export_c_header(
    agent: AnyAgent,
    path: str | Path,
    *,
    name: str | None = None,
    fraction_bits: int | None = None,
    learning: bool = False,
    durations: bool = False,
) -> CHeader:
    """Write an agent as a C header and return it.

    The file is written as a whole or not at all. The name is by default the file's, without its
    ending; everything else is as for `c_header`.
    """
    file, prefix = header_file(path, name)
    header = _header(
        agent, prefix, fraction_bits=fraction_bits, learning=learning, durations=durations
    )
    write_whole(file, header.text.encode())
    return header


def c_header(
    agent: AnyAgent,
    name: str,
    *,
    fraction_bits: int | None = None,
    learning: bool = False,
    durations: bool = False,
) -> CHeader:
    """Return an agent as a C header: its greedy policy, or the agent itself, which learns.

    The header is C99 and C++, needs ``<stdint.h>`` only, no heap and no floating point. The
    policy's action is that of ``agent.act(observation, explore=False)``; where the agent would draw
    one of several best actions, it takes the middle of their widest run. With a history of
    observations the policy has a struct with the memory of an episode. An agent that learns does
    and remembers in C what it would in Python in one environment, to the bit, as long as
    observations and rewards are multiples of ``2**-fraction_bits``. ``NAME_MISSING`` is a missing
    reading, which is treated as by the agent. See docs/how-to/small-processors.md.

    Parameters
    ----------
    agent : SDNNQLearning, SDNNQLambda or SDNNActorCritic
        With known ranges of its observations. Running ranges stay as they are, but in an
        `SDNNActorCritic` that learns.
    name : str
        Prefix of all names in the header.
    fraction_bits : int, optional
        Of observations, actions and rewards in fixed point, 0 to 30; by default 16, or fewer if the
        observed ranges or the actions need it.
    learning : bool, optional
        Write an agent that learns. It begins with what the agent has learned so far, in a new
        episode. An `SDNNQLearning` needs ``averaging_interval=0``, ``weight_limit=127`` and
        actions of one dimension.
    durations : bool, optional
        With ``learning``, also write ``NAME_learn_over``, which learns a transition of up to
        65,535 usual steps as ``Transition(..., dt=dt)`` does. Not for an `SDNNQLearning`.

    Raises
    ------
    TypeError
        For other agents, which calculate in floating point.
    ValueError
        If ``name`` is not a C identifier, ``fraction_bits`` is too large, the network has more
        than 65,535 hidden units or 2^26 weights, or a setting does not allow ``learning``.
    RuntimeError
        If the agent is still warming up.

    Warns
    -----
    UserWarning
        Of each range of observations or actions that has fewer than 64 values in fixed point.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLearning
    >>> from sdnn.export import c_header
    >>> env = gym.make("MountainCar-v0")
    >>> agent = SDNNQLearning(env.observation_space, env.action_space, preset="small")
    >>> header = c_header(agent, "car")
    >>> header.flash_bytes < 2**17
    True
    >>> "uint32_t action = car_greedy(observation);" in header.text
    True
    """
    return _header(agent, name, fraction_bits=fraction_bits, learning=learning, durations=durations)


def _header(
    agent: Any, name: str, *, fraction_bits: int | None, learning: bool, durations: bool
) -> CHeader:
    """Return an agent as a C header; warn the caller's caller of coarse ranges."""
    writer = writer_of(
        agent, require_c_name(name), fraction_bits, learns=learning, durations=durations
    )
    header: CHeader = writer.header()
    for message in writer.coarse_ranges():
        warnings.warn(message, stacklevel=3)
    return header


def writer_of(
    agent: Any, name: str, fraction_bits: int | None, *, learns: bool, durations: bool = False
) -> Any:
    """Return the writer of an agent's header, a `Learner` if it learns.

    TypeError for agents without a header. ValueError for agents and settings that C does not have.
    """
    flag("learning", learns)
    if flag("durations", durations):
        require(learns, "durations", "be False without learning=True", durations)
        expected = "be False for an SDNNQLearning, whose header learns usual steps alone"
        require(not isinstance(agent, SDNNQLearning), "durations", expected, durations)
    _require_exportable(agent, learns=learns)
    for agent_class, (policy_writer, learner) in _WRITERS.items():
        if isinstance(agent, agent_class):
            writer = (learner if learns else policy_writer)(agent, name, fraction_bits)
            writer.has_durations = durations
            return writer
    expected = "an SDNNQLearning, SDNNQLambda or SDNNActorCritic"
    raise TypeError(f"agent must be {expected}, got {shown(agent)}")


def _require_exportable(agent: Any, *, learns: bool) -> None:
    """Raise ValueError for action masks, SDNN-C with a history, and running ranges that learn."""
    has_history = getattr(agent, "history", "none") not in ("none", "auto")
    expected = "have history='none', as SDNNQLambda and SDNNActorCritic alone have a history in C"
    is_possible = not has_history or isinstance(agent, SDNNQLambda | SDNNActorCritic)
    require(is_possible, "agent", expected, agent)
    if learns and follows_ranges(agent):
        expected = (
            "have ranges of observations that stay, not running ones, to learn in C, unless it is"
            " an SDNNActorCritic with history='none' and missing='error': make it with"
            " observation_range=(low, high), or sdnn train --range LOW:HIGH"
        )
        is_possible = isinstance(agent, SDNNActorCritic) and agent.missing == "error"
        require(is_possible and not has_history, "agent", expected, agent)
    expected = (
        "have learned without action masks, which no C header has: it would take actions that are"
        " not allowed. Train without masks, with a reward that punishes such actions"
    )
    has_masks = isinstance(agent, BaseAgent) and agent._actions.has_masks
    require(not has_masks, "agent", expected, agent)


def save_image(agent: SDNNQLearning | SDNNQLambda | SDNNActorCritic) -> bytes:
    """Return what an agent has learned, as ``NAME_load`` of its header with ``learning`` reads it.

    The present episode is not part of it: its last transition may still have to be learned.
    """
    image: bytes = writer_of(agent, "agent", None, learns=True).image()
    return image


def load_image(agent: SDNNQLearning | SDNNQLambda | SDNNActorCritic, image: bytes) -> None:
    """Give an agent the state that ``NAME_save`` of its header wrote; an episode begins.

    Raises
    ------
    ValueError
        If the bytes are damaged, or those of an agent with other settings, spaces or another seed;
        the agent stays as it is.
    """
    writer = writer_of(agent, "agent", None, learns=True)
    is_bytes = isinstance(image, bytes | bytearray | memoryview)
    require(is_bytes, "image", "be bytes", image, TypeError)
    # An image begins with 8 bytes that identify the agent, and ends with a checksum of 4.
    whole, expected = bytes(image), writer.image()
    if len(whole) != len(expected):
        raise ValueError(f"image must have {len(expected)} bytes, got {len(whole)}")
    if zlib.crc32(whole[:-4]) != int.from_bytes(whole[-4:], "little"):
        raise ValueError("image is damaged: its checksum differs")
    if whole[:8] != expected[:8]:
        raise ValueError("image is that of an agent with other settings, spaces or another seed")
    try:
        writer.restore(whole)
    except ValueError as error:
        raise ValueError(f"image holds what no agent can have: {error}") from error
    agent.begin_episode()
