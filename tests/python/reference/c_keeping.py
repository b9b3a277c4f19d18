"""Programs in C that store agents while the power is cut, or keep an agent's best policy.

See docs/how-to/save-on-a-microcontroller.md for what the functions of the header do.
"""

from pathlib import Path

import numpy as np

from c_learners import index_without_draw, lines_of, run_agent
from c_policies import STRICT, lies_between, macros, place_of, run, store_action
from sdnn.export import c_header, load_image, save_image

POWER_CUTS = Path(__file__).parent / "power_cuts.c"


def compiled(source, agent, folder, target, *options):
    """Compile a program with the header of an agent that learns; return it as a command."""
    (folder / "agent.h").write_text(c_header(agent, "agent", learning=True).text)
    (folder / "main.c").write_text(source + "\n")
    return target.compile(folder / "main.c", *STRICT, *options)


def cut_power(make, folder, target, n_states, stride, *options):
    """Run power_cuts.c; return its counts: cuts, states lost, wrong or not stored, violations."""
    agent = make()
    action = "action" if agent.n_dimensions > 1 else "action[0]"
    reward, is_end = "any_byte() * 512 - 65536", "step % 9 == 0"
    definitions = macros(
        ACT=store_action(agent, "agent_act", "learner, x[0]"),
        LEARN=f"agent_learn(learner, x[0], {action}, {reward}, x[1], {is_end})",
    )
    source = definitions + POWER_CUTS.read_text()
    power_cuts = compiled(source, agent, folder, target, "-O2", *options)
    return [int(number) for number in run(*power_cuts, n_states, stride).split()]


# Reads the images of two agents, keeps the policy of the first, and loads the second. Then it reads
# observations and writes the actions of the kept policy. An exit code but 0 is the number of a
# check that failed.
KEEP_BEST = """
#include <stdio.h>
#include <string.h>
#include "agent.h"
static agent_agent agent;
static uint8_t images[2][AGENT_IMAGE_BYTES], memory[AGENT_KEPT_BYTES];
static agent_keeper keeper, same;
static int fails;
static int read_memory(void *context, uint32_t offset, uint8_t *bytes, uint32_t n) {
  if (fails || offset > AGENT_KEPT_BYTES || n > AGENT_KEPT_BYTES - offset) return 0;
  return agent_read_memory(context, offset, bytes, n);
}
static int write_memory(void *context, uint32_t offset, const uint8_t *bytes, uint32_t n) {
  if (n != AGENT_PART_BYTES || offset % n != 0 || n > AGENT_KEPT_BYTES - offset) return 0;
  return agent_write_memory(context, offset, bytes, n);
}
int main(void) {
  int32_t x[AGENT_N_OBSERVED];
  uint32_t best[AGENT_N_DIMENSIONS], greedy[AGENT_N_DIMENSIONS];
  EPISODES
  if (fread(images, 1, sizeof images, stdin) != sizeof images) return 1;
  if (agent_begin_keeping(&keeper, memory, read_memory, write_memory, 2)) return 2;
  agent_begin(&agent);
  if (!agent_load(&agent, images[0])) return 3;
  if (agent_keep(&agent, &keeper, -3) || !agent_keep(&agent, &keeper, -4)) return 4;
  if (!agent_load(&agent, images[1])) return 5;
  if (agent_keep(&agent, &keeper, -3) || agent_keep(&agent, &keeper, -4)) return 6;
  /* A program that starts finds the policy and its score in memory. */
  if (!agent_begin_keeping(&same, memory, read_memory, write_memory, 2)) return 7;
  if (same.best != -7 || same.scale != keeper.scale) return 8;
  while (fread(x, sizeof *x, AGENT_N_OBSERVED, stdin) == AGENT_N_OBSERVED) {
    ACT_BEST;
    fwrite(best, sizeof *best, AGENT_N_DIMENSIONS, stdout);
  }
  fails = 1; /* the memory cannot be read: the agent acts by its present policy */
  ACT_BEST;
  ACT_GREEDY;
  if (memcmp(best, greedy, sizeof best)) return 9;
  fails = 0;
  memory[9] ^= 16;
  if (agent_begin_keeping(&same, memory, read_memory, write_memory, 2)) return 10;
  return 0;
}
"""


def check_best(make, target, folder, *options):
    """Check that a kept policy acts as the agent did when it was kept, and not as it does later."""
    agent = make()
    header = c_header(agent, "agent", learning=True)
    run_agent(agent, lines_of(agent, 400, 1, header.fraction_bits), header.fraction_bits)
    kept = save_image(agent)
    later = make()
    load_image(later, kept)
    run_agent(later, lines_of(later, 900, 2, header.fraction_bits), header.fraction_bits)
    source = macros_of_acting(agent) + KEEP_BEST
    keep_best = compiled(source, agent, folder, target, *options)
    lines = lines_of(agent, 600, 3, header.fraction_bits)
    n_observed = (lines.shape[1] - 3) // 2
    observations = np.ascontiguousarray(lines[:, 1 : n_observed + 1])
    written = run(*keep_best, input=kept + save_image(later) + observations.tobytes())
    actions = np.frombuffer(written, "<u4").reshape(-1, agent.n_dimensions).tolist()
    scaled = observations / 2.0**header.fraction_bits
    assert actions == [greedy_indices(agent, x) for x in scaled]
    assert actions != [greedy_indices(later, x) for x in scaled]


def macros_of_acting(agent):
    """Return the macros of `KEEP_BEST`: one action by the best policy, and one by the present.

    An agent with a history acts in an episode, which begins with each observation here.
    """
    suffix = "_place" if lies_between(agent) else ""
    best, greedy = f"agent_best{suffix}", "agent_place" if suffix else "agent_greedy"
    if agent.history == "none":
        return macros(
            EPISODES="",
            ACT_BEST=store_action(agent, best, "&agent, &keeper, x", "best"),
            ACT_GREEDY=store_action(agent, greedy, "&agent, x", "greedy"),
        )
    begin = "agent_begin_greedy_episode(&agent, &{}); ".format
    act_best = store_action(agent, best, "&agent, &keeper, &best_episode, x", "best")
    act_greedy = store_action(agent, greedy, "&agent, &greedy_episode, x", "greedy")
    return macros(
        EPISODES="static agent_greedy_episode best_episode, greedy_episode;",
        ACT_BEST=begin("best_episode") + act_best,
        ACT_GREEDY=begin("greedy_episode") + act_greedy,
    )


def greedy_indices(agent, observation):
    """Return the indices or places of the greedy action in an episode that begins."""
    if agent.history != "none":
        agent.begin_greedy_episode()
    action = np.ravel(agent.act(observation, explore=False))
    indices = [
        place_of(agent.actions_of(d), part) if lies_between(agent)
        else int(np.abs(agent.actions_of(d) - part).argmin())
        for d, part in enumerate(action)
    ]  # fmt: skip
    return [index_without_draw(agent, observation, d, index) for d, index in enumerate(indices)]
