"""Images: the learned state of an agent in C, as bytes."""

from __future__ import annotations

import zlib

from sdnn.agents import SDNNQLambda, SDNNQLearning
from sdnn.export.header import writer_of
from sdnn.support.arguments import require


def save_image(agent: SDNNQLearning | SDNNQLambda) -> bytes:
    """Return what an agent has learned, as ``NAME_load`` of its header with ``learning`` reads it.

    The present episode is not part of it: its last transition may still have to be learned.
    """
    image: bytes = writer_of(agent, "agent", None, learns=True).image()
    return image


def load_image(agent: SDNNQLearning | SDNNQLambda, image: bytes) -> None:
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
