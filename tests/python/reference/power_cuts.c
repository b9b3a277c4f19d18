/* Cuts the power while an agent is stored in simulated flash, and restores it. Flash is erased by
 * pages, to ones, and programmed from ones to zeros, each byte once. A cut leaves the byte that is
 * programmed with some of its bits, and the page that is erased with some of the old ones.
 *
 * usage: power_cuts STATES STRIDE: stores STATES states one after the other, and cuts the power at
 * each STRIDE-th event of storing. Prints the numbers of cuts, of lost and wrong states, of states
 * that could not be stored after a cut, and of violations of the rules of flash. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "agent.h"

#define PAGE 512
#define ERASE_EVENTS 24 /* of a page, at which the power may be cut */
#define SLOT_PAGES ((AGENT_SLOT_BYTES + PAGE - 1) / PAGE)
#define N_BYTES (2 * SLOT_PAGES * PAGE)

static uint8_t flash[N_BYTES], before[N_BYTES];
static uint32_t n_left, noise = 1, n_violations;
static int is_off;

static uint8_t any_byte(void) {
  noise = noise * UINT32_C(1664525) + UINT32_C(1013904223);
  return (uint8_t)(noise >> 24);
}

/* Returns whether the power is cut at this event (a byte, or a stage of erasing), partial then. */
static int is_cut(void) {
  if (is_off || n_left == 0) return is_off = 1;
  --n_left;
  return 0;
}

static int read_flash(void *context, uint32_t address, uint8_t *bytes, uint32_t n) {
  (void)context;
  if (is_off) return 0;
  if (address > N_BYTES || n > N_BYTES - address) return 0;
  memcpy(bytes, flash + address, n);
  return 1;
}

static int program_flash(void *context, uint32_t address, const uint8_t *bytes, uint32_t n) {
  uint32_t i;
  (void)context;
  n_violations += n != AGENT_PART_BYTES || address % AGENT_PART_BYTES != 0;
  for (i = 0; i < n; ++i) {
    if (is_off) return 0;
    n_violations += flash[address + i] != 255;
    if (is_cut()) { /* some bits are programmed, or none */
      if (any_byte() & 1) flash[address + i] &= (uint8_t)(bytes[i] | any_byte());
      return 0;
    }
    flash[address + i] &= bytes[i];
  }
  return 1;
}

/* Erases pages in ascending or descending order. A cut sets random bits, fewer at early stages. */
static int erase_flash(void *context, uint32_t address, uint32_t n) {
  const uint32_t n_pages = (n + PAGE - 1) / PAGE;
  const int from_last = any_byte() & 1;
  uint32_t k, event, i;
  (void)context;
  n_violations += address % PAGE != 0;
  for (k = 0; k < n_pages; ++k) {
    uint8_t *const page = flash + address + (from_last ? n_pages - 1 - k : k) * PAGE;
    for (event = 0; event < ERASE_EVENTS; ++event) {
      if (!is_cut()) continue;
      for (i = 0; i < PAGE && event > 0; ++i) {
        page[i] |= event < ERASE_EVENTS / 2 ? any_byte() & any_byte() : any_byte();
      }
      return 0;
    }
    memset(page, 255, PAGE);
  }
  return 1;
}

static const agent_flash memory = {
    0, read_flash, program_flash, erase_flash, {0, SLOT_PAGES * PAGE}};

static agent_agent agent, restored;
static uint8_t old_image[AGENT_IMAGE_BYTES], new_image[AGENT_IMAGE_BYTES], image[AGENT_IMAGE_BYTES];

static void learn(agent_agent *learner, uint32_t n_steps) {
  int32_t x[2][AGENT_N_OBSERVED];
  uint32_t step, action[AGENT_N_DIMENSIONS], i;
  for (step = 0; step < n_steps; ++step) {
    for (i = 0; i < 2 * AGENT_N_OBSERVED; ++i) x[i & 1][i / 2] = any_byte() * 1024 - 131072;
    ACT;
    LEARN;
  }
  agent_begin_episode(learner);
}

/* Stores a state; the power is cut after this number of events. Returns whether it is stored. */
static int store_until(const agent_agent *stored, uint32_t n_events) {
  n_left = n_events;
  is_off = 0;
  return agent_store(stored, &memory);
}

/* Restarts the processor. Returns whether a state was restored; `image` is that state then. */
static int restore(void) {
  is_off = 0;
  n_left = UINT32_MAX;
  agent_begin(&restored);
  if (!agent_restore(&restored, &memory)) return 0;
  agent_save(&restored, image);
  return 1;
}

static int is_image(const uint8_t *expected) { return memcmp(image, expected, sizeof image) == 0; }

int main(int argc, char **argv) {
  const uint32_t n_states = (uint32_t)atol(argv[1]), stride = (uint32_t)atol(argv[2]);
  uint32_t state, cut, n_cuts = 0, n_lost = 0, n_wrong = 0, n_stuck = 0, i;
  for (i = 0; i < N_BYTES; ++i) flash[i] = any_byte(); /* nothing was ever stored */
  agent_begin(&agent);
  agent_save(&agent, old_image);
  n_wrong += (uint32_t)restore();
  n_stuck += !store_until(&agent, UINT32_MAX) || !restore() || !is_image(old_image);
  for (state = 0; state < n_states; ++state) {
    learn(&agent, 20);
    agent_save(&agent, new_image);
    memcpy(before, flash, sizeof flash);
    for (cut = state % stride;; cut += stride) {
      int is_stored, is_restored;
      memcpy(flash, before, sizeof flash);
      is_stored = store_until(&agent, cut);
      is_restored = restore();
      if (is_stored) {
        n_wrong += !is_restored || !is_image(new_image);
        break;
      }
      if (++n_cuts > n_states * 4 * N_BYTES) return 1; /* storing never ends */
      n_lost += !is_restored;
      n_wrong += is_restored && !is_image(old_image) && !is_image(new_image);
      /* A second cut, and then the state is stored. */
      store_until(&agent, (uint32_t)any_byte() * (N_BYTES / 512));
      is_restored = restore();
      n_lost += !is_restored;
      n_wrong += is_restored && !is_image(old_image) && !is_image(new_image);
      n_stuck += !store_until(&agent, UINT32_MAX) || !restore() || !is_image(new_image);
    }
    memcpy(old_image, new_image, sizeof old_image);
  }
  printf("%lu %lu %lu %lu %lu\n", (unsigned long)n_cuts, (unsigned long)n_lost,
         (unsigned long)n_wrong, (unsigned long)n_stuck, (unsigned long)n_violations);
  return argc > 3;
}
