/* Lives of an agent that balances the wheel's pendulum: it learns, keeps its best policy and saves
 * itself in flash; between two lives the power may be off. On the micro:bit flash is the chip's
 * own, and is erased and written by its controller. Elsewhere it is an array that the input begins
 * with.
 *
 * Input: lives as four numbers of 32 bits: steps, noise of the physics, writes to flash until the
 * power is cut, bytes of it that arrive in the last one. Output, for each whole life: whether
 * this program began with a restored state, the steps of ten episodes of the best policy, bytes of
 * stack used so far, and the agent's image; at the end, or when the power is cut, the flash.
 */
#define WITHOUT_MAIN
#define KEEP_EPISODES 10
#include "stack.h"
#include "wheel.c"

#define PAGE 1024
#define PAGES(n) (((n) + PAGE - 1) / PAGE * PAGE)
#define SLOT PAGES(POLE_SLOT_BYTES)
#define N_BYTES (2 * SLOT + PAGES(POLE_KEPT_BYTES))

static uint32_t n_writes, n_bytes; /* until the power is cut */

#ifdef NRF51
#define FLASH ((uint8_t*)UINT32_C(0x39000)) /* after the program's 228 kB */
typedef char states_fit[0x39000 + N_BYTES <= 0x40000 ? 1 : -1];
static volatile uint32_t* const controller = (volatile uint32_t*)UINT32_C(0x4001E000);
enum { READY = 0x400 / 4, CONFIG = 0x504 / 4, ERASE_PAGE = 0x508 / 4 };

static void set_controller(uint32_t mode) { /* 0: read, 1: write, 2: erase */
  controller[CONFIG] = mode;
  while (!controller[READY]) {
  }
}

static void erase_page(uint8_t* page) {
  set_controller(2);
  controller[ERASE_PAGE] = (uint32_t)(uintptr_t)page;
  set_controller(0);
}

static void write_word(uint8_t* to, const uint8_t* bytes) {
  const uint32_t word =
      bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
  set_controller(1);
  *(volatile uint32_t*)(void*)to = word;
  set_controller(0);
}
#else
static uint8_t FLASH[N_BYTES];

static void erase_page(uint8_t* page) {
  int i;
  for (i = 0; i < PAGE; ++i) page[i] = 255;
}

static void write_word(uint8_t* to, const uint8_t* bytes) {
  int i;
  for (i = 0; i < 4; ++i) to[i] &= bytes[i];
}
#endif

static int read_flash(void* context, uint32_t address, uint8_t* bytes, uint32_t n) {
  uint32_t i;
  (void)context;
  for (i = 0; i < n; ++i) bytes[i] = FLASH[address + i];
  return 1;
}

static void leave(void) {
  fwrite(FLASH, 1, N_BYTES, stdout);
  exit(0);
}

static int write_flash(void* context, uint32_t address, const uint8_t* bytes, uint32_t n) {
  uint32_t i;
  const int is_cut = n_writes-- == 0;
  (void)context;
  for (i = 0; i < n && !(is_cut && i >= n_bytes); i += 4)
    write_word(FLASH + address + i, bytes + i);
  if (is_cut) leave();
  return 1;
}

static int erase_flash(void* context, uint32_t address, uint32_t n) {
  uint32_t i;
  (void)context;
  for (i = 0; i < n; i += PAGE) erase_page(FLASH + address + i);
  return 1;
}

static const pole_flash flash = {0, read_flash, write_flash, erase_flash, {0, SLOT}};

static int read_kept(void* context, uint32_t offset, uint8_t* bytes, uint32_t n) {
  return read_flash(context, 2 * SLOT + offset, bytes, n);
}

static int write_kept(void* context, uint32_t offset, const uint8_t* bytes, uint32_t n) {
  if (offset == 0) erase_flash(context, 2 * SLOT, POLE_KEPT_BYTES);
  return write_flash(context, 2 * SLOT + offset, bytes, n);
}

/* Learns, and keeps the best policy each 2,000 steps. */
static void learn(uint32_t n_steps) {
  uint32_t step = 0;
  while (step < n_steps) {
    const uint32_t before = step;
    episode(LEARNING, n_steps - step < MOST_STEPS ? n_steps - step : MOST_STEPS, &step);
    if (step / 2000 > before / 2000) keep_best();
  }
  pole_begin_episode(&agent);
}

int main(void) {
  uint32_t life[4], result[3], offset, k, n;
  uint8_t part[64];
  paint_stack();
#ifndef NRF51
  if (fread(FLASH, 1, N_BYTES, stdin) != N_BYTES) return 1;
#endif
  pole_begin(&agent);
  result[0] = (uint32_t)pole_restore(&agent, &flash);
  pole_begin_keeping(&keeper, 0, read_kept, write_kept, 1);
  while (fread(life, sizeof life, 1, stdin) == 1) {
    n_writes = UINT32_MAX;
    noise = life[1];
    learn(life[0]);
    for (k = 0, result[1] = 0; k < 10; ++k) episode(BEST, MOST_STEPS, &result[1]);
    n_writes = life[2];
    n_bytes = life[3];
    if (!pole_store(&agent, &flash)) return 2;
    result[2] = stack_used();
    fwrite(result, sizeof result, 1, stdout);
    for (offset = 0; offset < POLE_IMAGE_BYTES; offset += n) {
      n = POLE_IMAGE_BYTES - offset < sizeof part ? POLE_IMAGE_BYTES - offset : sizeof part;
      pole_save_part(&agent, offset, part, n);
      fwrite(part, 1, n, stdout);
    }
  }
  leave();
  return 0;
}
