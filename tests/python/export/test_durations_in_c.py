"""Durations of transitions in headers that learn; test_learning_header.py compares whole lives."""

import gymnasium as gym
import numpy as np
import pytest

from c_learners import actor, discrete, dutch, network
from c_policies import STRICT, STRICT_CPP, program, run
from refusals import refuses
from sdnn import _core
from sdnn.agents import QLambdaConfig, SDNNQLambda
from sdnn.export import c_header

FACTORS = """
#include <stdio.h>
#include "agent.h"
int main(void) {
  uint32_t dt, numbers[2];
  while (fread(&dt, sizeof dt, 1, stdin) == 1) {
    const agent_factors factors = agent_factors_of(dt);
    numbers[0] = (uint32_t)factors.discount ^ AGENT_USUAL_DISCOUNT;
    numbers[1] = (uint32_t)factors.decay ^ AGENT_USUAL_TRACE_DECAY;
    fwrite(numbers, sizeof *numbers, 2, stdout);
  }
  return 0;
}
"""


def random_durations(n):
    """Durations of all sizes, times 2^16; the shortest is 0.001, which is 65.5 of these units."""
    random = np.random.default_rng(3)
    durations = np.exp2(random.uniform(6.1, 32.0, n)).astype(np.uint32)
    return np.concatenate([durations, np.arange(66, 5000, dtype=np.uint32)])


@pytest.mark.parametrize(
    ("discount", "trace_decay"), [(0.99, 0.8), (0.8, 1.0), (1.0, 0.9), (0.0, 0.5), (0.9999, 0.0)]
)
def test_factors_over_a_duration_are_those_of_the_library(discount, trace_decay, target, tmp_path):
    learning = QLambdaConfig(discount=discount, trace_decay=trace_decay)
    agent = SDNNQLambda(gym.spaces.Discrete(9), gym.spaces.Discrete(4), learning=learning)
    header = c_header(agent, "agent", learning=True, durations=True)
    (tmp_path / "agent.h").write_text(header.text)
    durations = random_durations(200_000)
    command = program(tmp_path, FACTORS, target.compiler, *STRICT, "-O2")
    numbers = np.frombuffer(run(command, input=durations.tobytes()), "<u4").reshape(-1, 2)
    part = np.asarray(_core.power(np.full(durations.size, discount), durations / 2.0**16))
    assert np.array_equal(numbers[:, 0], np.floor(part * 2.0**15 + 0.5))
    assert np.array_equal(numbers[:, 1], np.floor(part * trace_decay * 2.0**13 + 0.5))


def test_the_learner_class_of_cpp_learns_over_a_duration(needs, tmp_path):
    needs("g++")
    (tmp_path / "agent.h").write_text(
        c_header(dutch(), "agent", learning=True, durations=True).text
    )
    # Both learn that action 0 in x is worth 1. Then action 1 in y leads to x without a reward: its
    # value is that of x times 0.8 ** 2.5 for `slow`, and times 0.8 for `usual`. A duration below
    # 0.001 is ignored: were 0.0005 learned, y would be worth nearly as much as x. The agent is
    # Sarsa, so a step is pending until the next one, or until an episode begins.
    source = """
        #include "agent.h"
        static agent_learner slow, usual;
        int main() {
          const int32_t x[AGENT_N_OBSERVED] = {}, far = AGENT_FIXED(0.5);
          const int32_t y[AGENT_N_OBSERVED] = {far, far, far};
          for (agent_learner* learner : {&slow, &usual}) {
            learner->begin_episode();
            learner->learn_over(x, 0, AGENT_FIXED(1.0), y, true, AGENT_DURATION(1.0));
          }
          slow.learn_over(y, 1, 0, x, false, AGENT_DURATION(0.0005));
          slow.learn_over(y, 1, 0, x, false, AGENT_DURATION(2.5));
          usual.learn(y, 1, 0, x, false);
          slow.begin_episode();
          usual.begin_episode();
          return 0 < slow.q(y, 1) && slow.q(y, 1) < usual.q(y, 1) ? 0 : 1;
        }
    """
    run(program(tmp_path, f"#include <initializer_list>\n{source}", "g++", *STRICT_CPP))


def test_headers_that_cannot_learn_durations_are_refused():
    refuses("durations", c_header, actor(), "agent", durations=True)
    refuses("durations", c_header, network(), "agent", learning=True, durations=True)
    refuses("durations", c_header, discrete(), "agent", learning=True, durations=1, error=TypeError)


def test_export_with_durations(invoke, refused, tmp_path):
    new = ("export", "--new", "--range", "-1:1", "--actions", "2", "--c-header", "a.h")
    invoke(*new, "--durations")
    assert "a_learn_over" in (tmp_path / "a.h").read_text()
    assert "--durations" in refused(*new, "--durations", "--agent", "sdnn-c", code=2)
    discrete().save("agent.safetensors")
    policy = ("export", "agent.safetensors", "--c-header", "b.h", "--durations")
    assert "--durations needs --learning" in refused(*policy, code=2)
    invoke(*policy, "--learning")
