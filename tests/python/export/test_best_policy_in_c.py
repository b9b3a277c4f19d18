"""The best policy in C, by the rule of `SaveBestAgent`, while the agent learns on."""

import numpy as np
import pytest

from c_histories import actor_observer, differences
from c_keeping import check_best, compiled
from c_learners import actor, actor_vector, discrete, network, paper_rule, sarsa, several
from c_policies import SANITIZED, run
from sdnn.training.files import EpisodeBlock

SCORES = """
#include <stdio.h>
#include <stdlib.h>
#include "agent.h"
static agent_agent agent;
static uint8_t memory[AGENT_KEPT_BYTES];
static agent_keeper keeper;
int main(int argc, char **argv) {
  const uint32_t length = (uint32_t)atol(argv[1]);
  int64_t score;
  agent_begin(&agent);
  if (agent_begin_keeping(&keeper, memory, agent_read_memory, agent_write_memory, length)) return 1;
  while (fread(&score, sizeof score, 1, stdin) == 1) {
    putchar(agent_keep(&agent, &keeper, score) ? '1' : '0');
  }
  return argc > 2;
}
"""


@pytest.mark.parametrize("length", [1, 2, 7, 30])
def test_blocks_of_returns_are_compared_as_in_python(length, target, tmp_path):
    # Few different returns, so that sums are equal at times, and returns beyond the largest one.
    random = np.random.default_rng(length)
    scores = random.integers(-3, 4, 3000) * 65536
    scores[::100] = random.integers(-(2**41), 2**41, 30)
    block = EpisodeBlock(length)
    expected = "".join("01"[block.ends_best(float(score))] for score in scores)
    assert expected.count("1") > 1
    keep = compiled(SCORES, sarsa(), tmp_path, target, *SANITIZED)
    assert run(*keep, length, input=scores.astype("<i8").tobytes()).decode() == expected


OTHER_LENGTH = """
#include <stdio.h>
#include "agent.h"
static agent_agent agent;
static uint8_t memory[AGENT_KEPT_BYTES];
static agent_keeper keeper;
static void begin(uint32_t length) {
  const int is_kept =
      agent_begin_keeping(&keeper, memory, agent_read_memory, agent_write_memory, length);
  printf(" %d", is_kept);
}
static void keep(int64_t score) { printf("%d", agent_keep(&agent, &keeper, score)); }
int main(void) {
  agent_begin(&agent);
  begin(2), keep(100), keep(100); /* prints 0: no policy was kept; 0, 1: the block ends, the best */
  begin(1), keep(150), keep(140); /* 1: one was kept; 1: the first of its length; 0: no better */
  begin(1), keep(140), keep(160); /* 1: a policy was kept; 0: below 150; 1: above it */
  return 0;
}
"""


def test_the_first_block_replaces_a_policy_of_blocks_of_another_length(target, tmp_path):
    program = compiled(OTHER_LENGTH, sarsa(), tmp_path, target, *SANITIZED)
    assert run(*program).decode() == " 001 110 101"  # see the comments in the program


MAKERS = [
    discrete, sarsa, several, network, paper_rule, actor, actor_vector, differences, actor_observer,
]  # fmt: skip


@pytest.mark.parametrize("make", MAKERS, ids=lambda make: make.__name__)
def test_the_kept_policy_acts_as_the_agent_did_when_it_was_kept(make, target, tmp_path):
    # A C program keeps the policy, learns 900 steps more, and asks the kept policy for actions:
    # they must be those of a Python agent that has not learned these steps.
    check_best(make, target, tmp_path, *SANITIZED)
