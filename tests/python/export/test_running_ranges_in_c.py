"""Ranges that follow observations in C; test_learning_header.py compares whole lives."""

import zlib

import gymnasium as gym
import numpy as np
import pytest

from c_learners import SMALL, actor_running, build, lines_of, run_agent, run_program
from c_policies import STRICT, box, program, run
from refusals import refuses
from sdnn.agents import SDNNActorCritic, SDNNQLambda, SDNNQLearning, Transition
from sdnn.export import c_header, load_image, new_agent, save_image

HEAD = 120
"""Bytes of an image before the moments of ranges."""

ROOTS = """
#include <stdio.h>
#include "agent.h"
int main(void) {
  uint64_t x;
  while (fread(&x, sizeof x, 1, stdin) == 1) {
    x = agent_root(x);
    fwrite(&x, sizeof x, 1, stdout);
  }
  return 0;
}
"""


def test_square_roots_have_the_bits_of_ieee_754(target, tmp_path):
    (tmp_path / "agent.h").write_text(c_header(actor_running(), "agent", learning=True).text)
    roots = program(tmp_path, ROOTS, target.compiler, *STRICT, "-O2")
    random = np.random.default_rng(1)
    numbers = random.integers(0, 0x7FF0 << 48, 100_000, np.uint64).view(np.float64)
    whole = random.integers(0, 2**26, 1000).astype(float)
    near = np.concatenate([whole**2, np.nextafter(whole**2, 0), np.nextafter(whole**2, np.inf)])
    tiny = random.integers(0, 2**52, 1000, np.uint64).view(np.float64)
    numbers = np.concatenate([numbers, near, tiny, [0.0, 2.0, 1e-140]])
    roots_in_c = np.frombuffer(run(roots, input=numbers.tobytes()), "<u8")
    assert np.array_equal(roots_in_c, np.sqrt(numbers).view(np.uint64))


def test_an_image_brings_its_ranges_to_a_header_of_other_ranges(target, tmp_path):
    _, command = build(tmp_path, actor_running(), target)
    agent, same = actor_running(), actor_running()
    run_agent(agent, lines_of(agent, 500, 3, 16), 16)
    assert not np.array_equal(agent.observation_range, same.observation_range)
    initial_image = save_image(agent)
    load_image(same, initial_image)
    assert np.array_equal(agent.observation_range, same.observation_range)
    lines = lines_of(agent, 500, 4, 16)
    actions, image = run_program(command, initial_image, lines, agent.n_dimensions)
    assert actions == run_agent(agent, lines, 16)
    assert image == save_image(agent)
    assert run_agent(same, lines, 16) == actions


def test_an_image_brings_its_ranges_to_an_agent_that_chose_its_inputs():
    space = gym.spaces.Box(-np.inf, np.inf, (4,), np.float64)
    agents = [
        SDNNActorCritic(
            space, gym.spaces.Discrete(2), inputs="relevant", warm_up_steps=100, approximator=SMALL
        )
        for _ in range(2)
    ]
    for agent, n_steps in zip(agents, (300, 200), strict=True):
        random = np.random.default_rng(2)
        agent.begin_episode()
        now = np.zeros(4)
        for _ in range(n_steps):
            action = agent.act(now)
            following = 0.9 * now + 0.1 * action + random.normal(0, 0.1, 4)
            agent.learn(Transition(now, action, float(following[0]), following, False))
            now = following
    load_image(agents[1], save_image(agents[0]))
    assert np.array_equal(agents[0].observation_range, agents[1].observation_range)
    assert save_image(agents[0]) == save_image(agents[1])


# From HEAD on come four counts of at most 2^40, four means from -1e140 to 1e140, and four sums of
# squares, which are finite and not below 0.
@pytest.mark.parametrize(
    ("place", "number"),
    [
        (HEAD, np.uint64(2**40 + 1)),
        (HEAD + 32, np.float64(np.nan)),
        (HEAD + 40, np.float64(-np.inf)),
        (HEAD + 32, np.float64(1e141)),
        (HEAD + 64, np.float64(-1.0)),
        (HEAD + 88, np.float64(np.inf)),
    ],
)
def test_images_with_impossible_moments_are_refused(place, number, target, tmp_path):
    agent = actor_running()
    run_agent(agent, lines_of(agent, 200, 3, 16), 16)
    forged = bytearray(save_image(agent))
    forged[place : place + 8] = number.tobytes()
    forged[-4:] = zlib.crc32(forged[:-4]).to_bytes(4, "little")
    new = actor_running()
    refuses("image", load_image, new, bytes(forged))
    _, command = build(tmp_path, new, target)
    lines = lines_of(new, 50, 4, 16)
    actions, _ = run_program(command, bytes(forged), lines, 1)  # begins with the header's state
    assert actions == run_agent(new, lines, 16)


def test_agents_whose_running_ranges_cannot_learn_in_c_are_refused():
    spaces = box(1.0, 2.0), gym.spaces.Discrete(2)
    for agent_class in (SDNNQLambda, SDNNQLearning):
        refuses(
            "agent", c_header, agent_class(*spaces, observation_range="running"), "a", learning=True
        )
    for missing in ("hold", "code"):
        refuses("agent", c_header, SDNNActorCritic(*spaces, missing=missing), "a", learning=True)


def test_new_agents_may_begin_without_ranges(invoke, refused, tmp_path):
    new = ("export", "--new", "--actions", "2", "--c-header", "a.h")
    actor = (*new, "--agent", "actor-critic", "--range", "running")
    invoke(*actor, "--range", "running", "--range", "angle")
    header = (tmp_path / "a.h").read_text()
    space = gym.spaces.Box(-1.0, 1.0, (3,), np.float64)
    space.low[2], space.high[2] = -np.pi, np.pi
    agent = new_agent(
        space, gym.spaces.Discrete(2), kind="actor-critic", observation_range="running", angles=[2]
    )
    assert c_header(agent, "a", learning=True).text == header
    assert "all sensors" in refused(*actor, "--range", "1:2", code=2)
    assert "actor-critic" in refused(*new, "--range", "running", code=2)
