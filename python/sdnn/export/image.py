"""What an agent in C has learned, as bytes."""

from __future__ import annotations

import zlib

import numpy as np

from sdnn.agents import SDNNSarsa
from sdnn.arguments import shown
from sdnn.export.linear import IMAGE_HEAD, STREAMS, LearnerWriter

_NO_EXPONENT = -(2**31)


def save_image(agent: SDNNSarsa) -> bytes:
    """Return what an agent has learned, as ``NAME_load`` of its header with ``learning`` reads it.

    The present episode is not part of it: its last transition may still have to be learned.
    """
    return _writer(agent).image()


def load_image(agent: SDNNSarsa, image: bytes) -> None:
    """Give an agent the state that ``NAME_save`` of its header wrote; an episode begins.

    Raises
    ------
    ValueError
        If the bytes are damaged, or those of an agent with other settings, spaces or another seed;
        the agent stays as it is.
    """
    writer = _writer(agent)
    if not isinstance(image, (bytes, bytearray, memoryview)):
        raise TypeError(f"image must be bytes, got {shown(image)}")
    whole, expected = bytes(image), writer.image()
    if len(whole) != len(expected):
        raise ValueError(f"image must have {len(expected)} bytes, got {len(whole)}")
    if zlib.crc32(whole[:-4]) != int.from_bytes(whole[-4:], "little"):
        raise ValueError("image is damaged: its checksum differs")
    if whole[:8] != expected[:8]:
        raise ValueError("image is that of an agent with other settings, spaces or another seed")
    exponent = int.from_bytes(whole[8:12], "little", signed=True)
    n_snapshots, n_left, n_ended = np.frombuffer(whole, "<i4", 3, 12).tolist()
    n_learned, n_steps = np.frombuffer(whole, "<i8", 2, 24).tolist()
    words = np.frombuffer(whole, "<u8", 16, 40).reshape(4, 4)
    state = agent.core.state()
    for name in ("waits", "reward", "old_value"):  # of the episode before
        state[name] = np.zeros_like(state[name])
    state["trace.values"] = state["trace.values"][:0]
    for name in ("action_value.exponent", "n_random_left", "n_ended"):
        state.pop(name, None)
    state["n_learned"] = np.array(n_learned, np.int64)
    if exponent != _NO_EXPONENT:
        state["action_value.exponent"] = np.array(exponent, np.int32)
    if "action_value.n_steps" in state:
        state["action_value.n_steps"] = np.array(n_steps, np.int64)
        state["action_value.n_snapshots"] = np.array(n_snapshots, np.int64)
    if n_left:
        state["n_random_left"] = np.array(n_left, np.int32)
    if n_ended:
        state["n_ended"] = np.array(n_ended, np.int32)
    state |= {f"{name}.words": one.copy() for name, one in zip(STREAMS, words, strict=True)}
    kept = [name for name in ("weights", "averaged_weights") if f"action_value.{name}" in state]
    at, columns = IMAGE_HEAD, writer.columns()
    for name in kept:
        rows = np.zeros_like(state[f"action_value.{name}"])
        n = rows.shape[0] * columns.size
        rows[:, columns] = np.frombuffer(whole, "<i4", n, at).reshape(-1, columns.size)
        state[f"action_value.{name}"] = rows
        at += 4 * n
    try:
        agent.core.restore(state)
    except ValueError as error:
        raise ValueError(f"image holds what no agent can have: {error}") from error
    agent.begin_episode()


def _writer(agent: SDNNSarsa) -> LearnerWriter:
    if not isinstance(agent, SDNNSarsa):
        raise TypeError(f"agent must be an SDNNSarsa, got {type(agent).__name__}")
    return LearnerWriter(agent, "agent", None)
