/* Two slots of a memory that keeps its bytes without power, such as flash. An agent that is stored
 * replaces the older state, so that one of two is left wherever the power is cut.
 *
 *   static const sdnn_flash flash = {0, read, write, erase, {0x30000, 0x38000}};
 *   if (!sdnn_restore(&agent, &flash)) sdnn_begin(&agent); // when the program starts
 *   sdnn_begin_episode(&agent);
 *   sdnn_store(&agent, &flash); // after an episode, say
 *
 * A slot is a record with a counter, and an image. The record is written last, and names the
 * checksum of its image: it counts if both are whole. */
#ifndef SDNN_SLOTS_H
#define SDNN_SLOTS_H

#include "sdnn_image.h"

/* The bytes of a slot: erased at once, and written in parts, each once and in ascending order but
 * for the first one, which is the last. */
#define SDNN_IMAGE_PARTS ((SDNN_IMAGE_BYTES + SDNN_PART_BYTES - 1) / SDNN_PART_BYTES)
#define SDNN_SLOT_BYTES ((1 + SDNN_IMAGE_PARTS) * SDNN_PART_BYTES)

#define SDNN_RECORD_MAGIC UINT32_C(0x534e4453) /* "SDNS" */
#define SDNN_RECORD_BYTES 16

/* The memory. Its functions return whether they succeeded. */
typedef struct {
  void* context; /* which the functions receive */
  int (*read)(void* context, uint32_t address, uint8_t* bytes, uint32_t n);
  /* Writes SDNN_PART_BYTES bytes, of which all bits are 1 before if there is `erase`. */
  int (*write)(void* context, uint32_t address, const uint8_t* bytes, uint32_t n);
  /* Erases the pages from an address on that n bytes take, or null if bytes can be overwritten. */
  int (*erase)(void* context, uint32_t address, uint32_t n);
  uint32_t addresses[2]; /* of the slots, which share no page */
} sdnn_flash;

typedef struct {
  const sdnn_flash* flash;
  uint32_t address;
} sdnn_slot;

/* Reads the image of a slot. */
static inline int sdnn_read_slot(void* context, uint32_t offset, uint8_t* bytes, uint32_t n) {
  const sdnn_slot* const slot = (const sdnn_slot*)context;
  const sdnn_flash* const flash = slot->flash;
  return flash->read(flash->context, slot->address + SDNN_PART_BYTES + offset, bytes, n);
}

/* Whether a slot has a whole record and its image; reads the counter. */
static inline int sdnn_is_stored(sdnn_slot slot, uint32_t* counter) {
  uint8_t record[SDNN_RECORD_BYTES], head[SDNN_IMAGE_HEAD];
  uint32_t checksum = 0;
  const sdnn_flash* const flash = slot.flash;
  if (!flash->read(flash->context, slot.address, record, SDNN_RECORD_BYTES)) return 0;
  *counter = (uint32_t)sdnn_get(record + 4, 4);
  return sdnn_get(record, 4) == SDNN_RECORD_MAGIC &&
         sdnn_get(record + 12, 4) == (uint32_t)~sdnn_add_to_checksum(UINT32_MAX, record, 12) &&
         sdnn_scan(0, sdnn_read_slot, &slot, head, &checksum) &&
         sdnn_get(record + 8, 4) == checksum;
}

/* Finds the newest state. Returns whether there is one; if not, the slot is the second one. */
static inline int sdnn_find_newest(const sdnn_flash* flash, sdnn_slot* newest, uint32_t* counter) {
  sdnn_slot first;
  uint32_t counters[2] = {0, 0};
  int is_first, is_second;
  first.flash = newest->flash = flash;
  first.address = flash->addresses[0];
  newest->address = flash->addresses[1];
  is_first = sdnn_is_stored(first, &counters[0]);
  is_second = sdnn_is_stored(*newest, &counters[1]);
  *counter = is_second ? counters[1] : 0;
  /* Counters may start again from 0: the newer one is less than half a cycle ahead. */
  if (is_first && (!is_second || counters[0] - counters[1] < UINT32_C(0x80000000))) {
    *newest = first;
    *counter = counters[0];
  }
  return is_first || is_second;
}

/* Stores the agent in place of the older state. Returns whether it can be read again; if not, the
 * newest state is still there. The episode is not stored: call sdnn_begin_episode before. */
static inline int sdnn_store(const sdnn_agent* agent, const sdnn_flash* flash) {
  uint8_t bytes[SDNN_PART_BYTES];
  sdnn_slot slot;
  uint32_t counter, stored, i;
  sdnn_find_newest(flash, &slot, &counter);
  slot.address = flash->addresses[slot.address == flash->addresses[0]];
  if (flash->erase && !flash->erase(flash->context, slot.address, SDNN_SLOT_BYTES)) return 0;
  for (i = 0; i < SDNN_IMAGE_PARTS; ++i) {
    const uint32_t address = slot.address + (i + 1) * SDNN_PART_BYTES;
    sdnn_save_part(agent, i * SDNN_PART_BYTES, bytes, SDNN_PART_BYTES);
    if (!flash->write(flash->context, address, bytes, SDNN_PART_BYTES)) return 0;
  }
  for (i = 0; i < SDNN_PART_BYTES; ++i) bytes[i] = 255;
  sdnn_put(sdnn_put(bytes, SDNN_RECORD_MAGIC, 4), ++counter, 4);
  sdnn_put(bytes + 8, sdnn_image_checksum(agent), 4);
  sdnn_put(bytes + 12, (uint32_t)~sdnn_add_to_checksum(UINT32_MAX, bytes, 12), 4);
  if (!flash->write(flash->context, slot.address, bytes, SDNN_PART_BYTES)) return 0;
  return sdnn_is_stored(slot, &stored) && stored == counter;
}

/* Loads the newest state. Returns whether there was one; if not, the agent stays as it is, or is as
 * it was exported if the memory changed while it was read. */
static inline int sdnn_restore(sdnn_agent* agent, const sdnn_flash* flash) {
  sdnn_slot slot;
  uint32_t counter;
  return sdnn_find_newest(flash, &slot, &counter) && sdnn_load_from(agent, sdnn_read_slot, &slot);
}

#endif /* SDNN_SLOTS_H */
