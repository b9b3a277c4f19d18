"""Images of what agents learn in C: those that Python refuses, and what they replace."""

import zlib
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from c_learners import (
    SMALL,
    actor_discrete,
    discrete,
    lines_of,
    network,
    paper_rule,
    run_agent,
    sarsa,
)
from c_policies import box
from refusals import refuses
from sdnn.agents import SDNNQLambda, Transition
from sdnn.export import load_image, save_image
from sdnn.export.header import writer_of


@pytest.mark.parametrize("make", [discrete, network, actor_discrete])
def test_images_of_other_agents_are_refused_and_change_nothing(make):
    agent, loaded = make(), make()
    run_agent(agent, lines_of(agent, 300, 1, 16), 16)
    image = save_image(agent)
    before = save_image(loaded)
    for position in range(0, len(image), len(image) // 97):
        damaged = bytearray(image)
        damaged[position] ^= 4
        with pytest.raises(ValueError, match=r"damaged|another seed"):
            load_image(loaded, bytes(damaged))
    for of_wrong_size in (image[:-1], image + b"x", b""):
        refuses("image", load_image, loaded, of_wrong_size)
    refuses("image", load_image, loaded, 3, error=TypeError)
    refuses("image", load_image, sarsa(), image)
    refuses("image", load_image, paper_rule(), image)
    config = replace(SMALL, averaging_interval=8)
    with_averages = SDNNQLambda(
        box(1.0, 2.0, 3.0), gym.spaces.Discrete(3, start=-1), seed=1, approximator=config,
        inputs="all", angle_pairs=[],
    )  # fmt: skip
    refuses("image", load_image, with_averages, image)
    assert save_image(loaded) == before
    load_image(loaded, image)
    assert save_image(loaded) == image


def fields_of(agent):
    """Return the place of each field in the agent's image, as a slice."""
    layout = writer_of(agent, "agent", None, learns=True).layout()
    places = ((name, layout.fields[name]) for name in layout.names)
    return {name: slice(start, start + dtype.itemsize) for name, (dtype, start) in places}


def forged(image, place, content):
    """Return the image with other bytes at a place, and the checksum of all bytes."""
    changed = image[: place.start] + content + image[place.start + len(content) : -4]
    return changed + zlib.crc32(changed).to_bytes(4, "little")


def test_an_image_of_a_linear_agent_with_impossible_numbers_is_refused():
    agent, same = discrete(), discrete()
    for trained in (agent, same):
        run_agent(trained, lines_of(agent, 300, 1, 16), 16)
        trained.act([0.1, 0.2, 0.3])  # a refusal does not end the running episode either
        trained.learn(Transition([0.1, 0.2, 0.3], 0, 1.0, [0.2, 0.2, 0.3], False))
    image, fields = save_image(agent), fields_of(agent)
    for name in ("action_value.n_snapshots", "n_ended", "n_learned", "action_value.n_steps"):
        n_bytes = fields[name].stop - fields[name].start
        refuses("image", load_image, agent, forged(image, fields[name], b"\xff" * n_bytes))
    states = agent._state_of("agent"), same._state_of("agent")
    assert all(np.array_equal(states[0][name], states[1][name]) for name in states[1])


def test_an_image_of_a_new_agent_replaces_all_that_was_learned():
    agent, new = discrete(), discrete()
    lines = lines_of(agent, 300, 1, 16)
    run_agent(agent, lines[:-1], 16)
    agent.act([0.1, 0.2, 0.3])  # the episode, whose last transition is pending, ends with the image
    agent.learn(Transition([0.1, 0.2, 0.3], 0, 1.0, [0.2, 0.2, 0.3], False))
    load_image(agent, save_image(new))
    assert run_agent(agent, lines, 16) == run_agent(new, lines, 16)
    assert save_image(agent) == save_image(new)


def test_an_image_of_a_network_with_impossible_numbers_is_refused():
    agent = network()
    image, fields = save_image(agent), fields_of(agent)
    # The first weight is a sum, which is even or odd as the difference of the same two weights is.
    other_parity = bytes([image[fields["weights"].start] ^ 1])

    def last_byte(place):  # sign, exponent or most significant bits
        return slice(place.stop - 1, place.stop)

    changes = [
        (last_byte(fields["fraction_bits"]), b"\xff"),
        (last_byte(fields["reward_scale.size"]), b"\x0f"),
        (last_byte(fields["progress"]), b"\xff"),
        (fields["action_value.output_range"], b"\xff" * 8),  # q_low
        (last_byte(fields["range.due"]), b"\1"),
        (last_byte(fields["n_rewards"]), b"\xff"),
        (fields["words"], bytes(32)),  # a generator of which all bits are 0
        (fields["weights"], b"\0"),  # weights are stored plus 128, and at least -127
        (fields["weights"], other_parity),
    ]
    for place, content in changes:
        refuses("image", load_image, agent, forged(image, place, content))
        assert save_image(agent) == image
