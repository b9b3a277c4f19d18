"""Programs in C that store agents while the power is cut, or keep an agent's best policy."""

from pathlib import Path

import numpy as np

from c_learners import index_without_draw, lines_of, run_agent
from c_policies import STRICT, lies_between, place_of, run
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
    is_vector = agent.n_dimensions > 1
    act = (
        "agent_act(learner, x[0], action)" if is_vector else "action[0] = agent_act(learner, x[0])"
    )
    learn = f"agent_learn(learner, x[0], {'action' if is_vector else 'action[0]'}"
    learn += ", any_byte() * 512 - 65536, x[1], step % 9 == 0)"
    source = POWER_CUTS.read_text().replace("ACT;", f"{act};").replace("LEARN;", f"{learn};")
    power_cuts = compiled(source, agent, folder, target, "-O2", *options)
    return [int(number) for number in run(*power_cuts, n_states, stride).split()]


BEST = """
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
  uint32_t action[AGENT_N_DIMENSIONS], greedy[AGENT_N_DIMENSIONS];
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
    BEST;
    fwrite(action, sizeof *action, AGENT_N_DIMENSIONS, stdout);
  }
  fails = 1; /* then it acts by the present policy, as it does where nothing is kept */
  BEST;
  GREEDY;
  if (memcmp(action, greedy, sizeof action)) return 9;
  fails = 0;
  memory[9] ^= 16;
  if (agent_begin_keeping(&same, memory, read_memory, write_memory, 2)) return 10;
  return 0;
}
"""


def check_best(make, target, folder, *options):
    """Check that a kept policy acts as the agent did when it was kept."""
    agent = make()
    header = c_header(agent, "agent", learning=True)
    run_agent(agent, lines_of(agent, 400, 1, header.fraction_bits), header.fraction_bits)
    kept = save_image(agent)
    later = make()  # learns more, so that its policy differs from the kept one
    load_image(later, kept)
    run_agent(later, lines_of(later, 900, 2, header.fraction_bits), header.fraction_bits)
    n = agent.n_dimensions
    has_history = agent.history != "none"
    place = "_place" if lies_between(agent) else ""
    arguments = [f"agent_best{place}(&agent, &keeper, ", "agent_place(&agent, "]
    if not place:
        arguments[1] = "agent_greedy(&agent, "
    calls = []
    for call, array in zip(arguments, ("action", "greedy"), strict=True):
        full = f"{call}{f'&{array}_episode, ' if has_history else ''}x"
        calls.append(f"{array}[0] = {full})" if n == 1 else f"{full}, {array})")
    episodes = ""
    if has_history:
        episodes = "static agent_greedy_episode action_episode, greedy_episode;"
        begin = "agent_begin_greedy_episode(&agent, &{}_episode); "
        calls = [begin.format(a) + c for a, c in zip(("action", "greedy"), calls, strict=True)]
    source = BEST.replace("EPISODES", episodes)
    source = source.replace("  BEST;", f"  {calls[0]};").replace("GREEDY;", f"{calls[1]};")
    best = compiled(source, agent, folder, target, *options)
    lines = lines_of(agent, 600, 3, header.fraction_bits)
    observations = np.ascontiguousarray(lines[:, 1 : (lines.shape[1] - 3) // 2 + 1])
    written = run(*best, input=kept + save_image(later) + observations.tobytes())
    actions = np.frombuffer(written, "<u4").reshape(-1, n).tolist()
    assert actions == [greedy_indices(agent, x / 2.0**header.fraction_bits) for x in observations]
    others = [greedy_indices(later, x / 2.0**header.fraction_bits) for x in observations]
    assert actions != others


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
