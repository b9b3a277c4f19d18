"""Agents in C that are saved in parts, and stored in memory that keeps its bytes without power."""

import zlib

import numpy as np
import pytest

from c_keeping import compiled, cut_power
from c_learners import (
    LEARNERS,
    actor,
    actor_vector,
    discrete,
    lines_of,
    network,
    run_agent,
    sarsa,
    small_steps,
    states,
)
from c_policies import SANITIZED, run
from sdnn.export import load_image, save_image

PARTS = """
#include <stdio.h>
#include <stdlib.h>
#include "agent.h"
static agent_agent agent;
static uint8_t image[AGENT_IMAGE_BYTES], bytes[AGENT_IMAGE_BYTES + 100];
int main(int argc, char **argv) {
  const uint32_t n = (uint32_t)atol(argv[1]);
  uint32_t offset, i;
  if (fread(image, 1, sizeof image, stdin) != sizeof image) return 1;
  agent_begin(&agent);
  if (!agent_load(&agent, image)) return 2;
  for (offset = 0; offset < sizeof image; offset += n) {
    bytes[offset + n] = 7; /* is not written */
    agent_save_part(&agent, offset, bytes + offset, n);
    if (bytes[offset + n] != 7) return 3;
  }
  for (i = sizeof image; i < offset; ++i) {
    if (bytes[i] != 255) return 4;
  }
  fwrite(bytes, 1, sizeof image, stdout);
  return argc > 2;
}
"""

FAILING = """
#include <stdio.h>
#include <string.h>
#include "agent.h"
static agent_agent agent;
static uint8_t images[2][AGENT_IMAGE_BYTES], saved[AGENT_IMAGE_BYTES], first[AGENT_IMAGE_BYTES];
static uint32_t n_calls, fails_at, changes_at;
static int read_image(void *context, uint32_t offset, uint8_t *bytes, uint32_t n) {
  const uint32_t call = n_calls++;
  (void)context;
  if (call == fails_at) return 0;
  memcpy(bytes, images[call >= changes_at] + offset, n);
  return 1;
}
int main(void) {
  uint32_t n_parts = (AGENT_IMAGE_BYTES + AGENT_PART_BYTES - 1) / AGENT_PART_BYTES, i;
  if (fread(images, 1, sizeof images, stdin) != sizeof images) return 1;
  agent_begin(&agent);
  agent_save(&agent, first);
  for (i = 0; i < 4 * n_parts; ++i) {
    agent_begin(&agent);
    if (!agent_load(&agent, images[1])) return 2;
    n_calls = 0;
    fails_at = i < 2 * n_parts ? i : UINT32_MAX;
    changes_at = i < 2 * n_parts ? UINT32_MAX : i - 2 * n_parts;
    if (agent_load_from(&agent, read_image, 0) != (changes_at == 0)) return 3;
    agent_save(&agent, saved);
    if (memcmp(saved, images[1], sizeof saved) && memcmp(saved, first, sizeof saved)) return 4;
    if (fails_at < n_parts && memcmp(saved, images[1], sizeof saved)) return 5;
  }
  fails_at = changes_at = UINT32_MAX;
  if (!agent_load_from(&agent, read_image, 0)) return 6;
  agent_save(&agent, saved);
  return memcmp(saved, images[0], sizeof saved) != 0;
}
"""


def trained(make, seed=1, n_steps=300):
    """Return an agent that has learned."""
    agent = make()
    run_agent(agent, lines_of(agent, n_steps, seed, 16), 16)
    return agent


@pytest.mark.parametrize("name", LEARNERS)
def test_parts_of_any_size_are_those_of_the_image(name, target, tmp_path):
    agent = trained(LEARNERS[name])
    image = save_image(agent)
    parts = compiled(PARTS, agent, tmp_path, target, *SANITIZED)
    for n in (1, 3, 64, 97, len(image)):
        assert run(*parts, n, input=image) == image


@pytest.mark.parametrize("make", [discrete, network, actor])
def test_a_load_that_fails_leaves_the_agent_or_begins_a_new_one(make, target, tmp_path):
    # An image is read twice in parts, to check it and to load it. Each call fails in turn, or reads
    # the image of another moment from there on: from the first call on, that one is loaded. If the
    # first reading fails, the agent stays as it is, image 1; if the second does, a new one begins.
    loaded, agent = trained(make, seed=2), trained(make)
    image = save_image(agent)
    load_image(agent, image)
    failing = compiled(FAILING, make(), tmp_path, target, *SANITIZED)
    run(*failing, input=image + save_image(loaded))


@pytest.mark.parametrize("make", [states, sarsa, network, small_steps, actor_vector])
def test_a_cut_of_the_power_leaves_the_old_or_the_new_state(make, target, tmp_path):
    # Six stores, each cut off after every 61st byte. Faults are states that are lost, wrong or not
    # stored, and writes that flash memory does not allow.
    n_cuts, *faults = cut_power(make, tmp_path, target, 6, 61, *SANITIZED)
    assert n_cuts > 60
    assert faults == [0, 0, 0, 0]


@pytest.mark.slow
@pytest.mark.parametrize("make", [states, sarsa, network, actor_vector])
def test_no_cut_of_the_power_at_any_byte_loses_a_state(make, target, tmp_path):
    image_bytes = len(save_image(make()))  # a cut at each byte, and at least 20,000 cuts
    n_cuts, *faults = cut_power(make, tmp_path, target, 25_000 // image_bytes + 1, 1)
    assert n_cuts >= 20_000
    assert faults == [0, 0, 0, 0]


OVERWRITTEN = """
#include <stdio.h>
#include <string.h>
#include "agent.h"
static agent_agent agent;
static uint8_t memory[2 * AGENT_SLOT_BYTES], old_image[AGENT_IMAGE_BYTES], image[AGENT_IMAGE_BYTES];
static uint32_t n_left = UINT32_MAX;
static int read_bytes(void *context, uint32_t address, uint8_t *bytes, uint32_t n) {
  memcpy(bytes, (uint8_t *)context + address, n);
  return 1;
}
static int write_bytes(void *context, uint32_t address, const uint8_t *bytes, uint32_t n) {
  for (; n > 0 && n_left > 0; --n, --n_left) ((uint8_t *)context)[address++] = *bytes++;
  return n == 0;
}
static const agent_flash flash = {memory, read_bytes, write_bytes, 0, {0, AGENT_SLOT_BYTES}};
int main(void) {
  const int32_t x[AGENT_N_OBSERVED] = {0};
  uint32_t cut, n_new = 0;
  agent_begin(&agent);
  if (agent_restore(&agent, &flash) || !agent_store(&agent, &flash)) return 1;
  for (cut = 0; cut <= AGENT_SLOT_BYTES; ++cut) {
    agent_save(&agent, old_image);
    agent_learn(&agent, x, 0, AGENT_FIXED(1.0), x, 1);
    n_left = cut;
    if (agent_store(&agent, &flash) && cut < AGENT_RECORD_BYTES) return 2;
    n_left = UINT32_MAX;
    if (!agent_restore(&agent, &flash)) return 3;
    agent_save(&agent, image);
    n_new += memcmp(image, old_image, sizeof image) != 0;
  }
  printf("%lu", (unsigned long)n_new);
  return 0;
}
"""


def test_memory_that_is_overwritten_needs_no_erasing(target, tmp_path):
    # Power is cut after 0 to 64 bytes of the last part: the new state counts from the 16 bytes of
    # its record on, in 64 - 16 + 1 cases.
    overwritten = compiled(OVERWRITTEN, sarsa(), tmp_path, target, *SANITIZED)
    assert int(run(*overwritten)) == 64 - 16 + 1


def test_damaged_images_are_never_restored(target, tmp_path):
    damaged = compiled(
        "#include \"agent.h\"\n#include <stdio.h>\n"
        "static agent_agent agent; static uint8_t image[AGENT_IMAGE_BYTES];\n"
        "int main(void) { agent_begin(&agent);"
        " while (fread(image, 1, sizeof image, stdin) == sizeof image)"
        " if (agent_load(&agent, image)) return 1; return 0; }",
        discrete(), tmp_path, target, *SANITIZED,
    )  # fmt: skip
    image = save_image(trained(discrete))
    random = np.random.default_rng(1)
    images = []
    for position in random.integers(0, len(image), 300):
        changed = bytearray(image)
        changed[position] ^= 1 << random.integers(8)
        images.append(bytes(changed))
    forged = bytearray(image)  # of another agent
    forged[5] ^= 1
    forged[-4:] = zlib.crc32(forged[:-4]).to_bytes(4, "little")
    run(*damaged, input=b"".join([*images, bytes(forged)]))
