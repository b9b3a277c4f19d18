/* An agent's state as bytes, its image, which is written and read in parts: no second buffer is
 * needed. The library reads and writes images too.
 *
 * The file that includes this one defines sdnn_agent before, SDNN_IMAGE_HEAD and SDNN_IMAGE_BYTES,
 * the bytes before the arrays and of the whole image, and before or after it sdnn_begin and
 *
 *   sdnn_carry_head(agent, head, reads)    the head of an image, or the agent's from it
 *   sdnn_carry_arrays(agent, part, reads)  those bytes of a part that are in arrays, or into them
 *   sdnn_begin_as(agent, head)             makes an agent with a head, whose arrays are 0
 *   sdnn_is_head(head)                     whether the numbers of a head are possible
 *   sdnn_is_possible(part)                 whether the numbers of arrays in a part are possible */
#ifndef SDNN_IMAGE_H
#define SDNN_IMAGE_H

#include "sdnn_learner.h"

/* The bytes that are written and read at once. Define it before the include for a memory that is
 * written in larger units, such as 256 for the flash of an RP2040. */
#ifndef SDNN_PART_BYTES
#define SDNN_PART_BYTES 64
#endif
typedef char sdnn_needs_parts_of_16_bytes[SDNN_PART_BYTES % 16 == 0 ? 1 : -1];

/* The CRC-32 of any content followed by its own checksum. */
#define SDNN_UNDAMAGED UINT32_C(0xdebb20e3)

/* Reads n bytes of an image, from `offset` on. Returns whether it could. */
typedef int (*sdnn_reader)(void* context, uint32_t offset, uint8_t* bytes, uint32_t n);

static inline void sdnn_begin(sdnn_agent* agent);
static inline void sdnn_carry_head(sdnn_agent* agent, uint8_t* head, int reads);
static inline void sdnn_carry_arrays(sdnn_agent* agent, const sdnn_part* part, int reads);
static inline void sdnn_begin_as(sdnn_agent* agent, const uint8_t* head);
static inline int sdnn_is_head(const uint8_t* head);
static inline int sdnn_is_possible(const sdnn_part* part);

/* Writes the bytes of a part that are in the image's content. */
static inline void sdnn_write_content(const sdnn_agent* agent, const sdnn_part* part) {
  if (part->offset < SDNN_IMAGE_HEAD) {
    uint8_t head[SDNN_IMAGE_HEAD];
    uint32_t i;
    sdnn_carry_head((sdnn_agent*)agent, head, 0);
    sdnn_put(sdnn_put(head, SDNN_IMAGE_MAGIC, 4), SDNN_FINGERPRINT, 4);
    for (i = 0; i < part->n && part->offset + i < SDNN_IMAGE_HEAD; ++i) {
      part->bytes[i] = head[part->offset + i];
    }
  }
  sdnn_carry_arrays((sdnn_agent*)agent, part, 0);
}

/* The checksum of the agent's image. */
static inline uint32_t sdnn_image_checksum(const sdnn_agent* agent) {
  uint8_t bytes[SDNN_PART_BYTES];
  sdnn_part part;
  uint32_t crc = UINT32_MAX;
  part.bytes = bytes;
  for (part.offset = 0; part.offset < SDNN_IMAGE_BYTES - 4; part.offset += part.n) {
    part.n = SDNN_IMAGE_BYTES - 4 - part.offset;
    if (part.n > SDNN_PART_BYTES) part.n = SDNN_PART_BYTES;
    sdnn_write_content(agent, &part);
    crc = sdnn_add_to_checksum(crc, bytes, part.n);
  }
  return ~crc;
}

/* Writes n bytes of the image, from `offset` on; behind its end they are 255. The agent must not
 * learn before all parts are written. The episode is not part of an image: call sdnn_begin_episode
 * before the first part, so that the last transition is learned. */
static inline void sdnn_save_part(const sdnn_agent* agent, uint32_t offset, uint8_t* bytes,
                                  uint32_t n) {
  const uint32_t n_image_bytes = SDNN_IMAGE_BYTES;
  sdnn_part part;
  uint32_t i, checksum;
  part.bytes = bytes;
  part.offset = offset;
  part.n = n;
  for (i = offset < n_image_bytes ? n_image_bytes - offset : 0; i < n; ++i) bytes[i] = 255;
  sdnn_write_content(agent, &part);
  if (offset < n_image_bytes && offset + n > n_image_bytes - 4) {
    checksum = sdnn_image_checksum(agent);
    sdnn_carry_words(&part, &checksum, n_image_bytes - 4, 1, 0);
  }
}

/* Writes the whole image, of SDNN_IMAGE_BYTES bytes, as sdnn_save_part does. */
static inline void sdnn_save(const sdnn_agent* agent, uint8_t* image) {
  sdnn_save_part(agent, 0, image, SDNN_IMAGE_BYTES);
}

/* Reads a whole image and its head. Returns whether it is one of this agent and undamaged, with
 * possible numbers. Unless `agent` is null, its arrays become those of the image, in any case. */
static inline int sdnn_scan(sdnn_agent* agent, sdnn_reader read, void* context, uint8_t* head,
                            uint32_t* checksum) {
  uint8_t bytes[SDNN_PART_BYTES];
  sdnn_part part;
  uint32_t crc = UINT32_MAX, i;
  int is_possible = 1;
  part.bytes = bytes;
  for (part.offset = 0; part.offset < SDNN_IMAGE_BYTES; part.offset += part.n) {
    part.n = SDNN_IMAGE_BYTES - part.offset;
    if (part.n > SDNN_PART_BYTES) part.n = SDNN_PART_BYTES;
    if (!read(context, part.offset, bytes, part.n)) return 0;
    crc = sdnn_add_to_checksum(crc, bytes, part.n);
    for (i = 0; i < part.n && part.offset + i < SDNN_IMAGE_HEAD; ++i) {
      head[part.offset + i] = bytes[i];
    }
    is_possible &= sdnn_is_possible(&part);
    sdnn_carry_words(&part, checksum, SDNN_IMAGE_BYTES - 4, 1, 1);
    if (agent) sdnn_carry_arrays(agent, &part, 1);
  }
  return crc == SDNN_UNDAMAGED && sdnn_get(head, 4) == SDNN_IMAGE_MAGIC &&
         sdnn_get(head + 4, 4) == SDNN_FINGERPRINT && is_possible && sdnn_is_head(head);
}

/* Loads the image that `read` reads, which is read twice: the agent changes if all of it is in
 * order. Returns whether it is. If the second reading fails or differs, the agent is as it was
 * exported: it is never part of an image. */
static inline int sdnn_load_from(sdnn_agent* agent, sdnn_reader read, void* context) {
  uint8_t head[SDNN_IMAGE_HEAD];
  uint32_t checksum = 0, same = 0;
  if (!sdnn_scan(0, read, context, head, &checksum)) return 0;
  sdnn_begin_as(agent, head);
  if (sdnn_scan(agent, read, context, head, &same) && same == checksum) return 1;
  sdnn_begin(agent);
  return 0;
}

/* Reads from memory. */
static inline int sdnn_read_memory(void* context, uint32_t offset, uint8_t* bytes, uint32_t n) {
  const uint8_t* const image = (const uint8_t*)context + offset;
  uint32_t i;
  for (i = 0; i < n; ++i) bytes[i] = image[i];
  return 1;
}

/* Returns whether the image is one of this agent, whole and in range; if not, nothing changes. */
static inline int sdnn_load(sdnn_agent* agent, const uint8_t* image) {
  return sdnn_load_from(agent, sdnn_read_memory, (void*)image);
}

#endif /* SDNN_IMAGE_H */
