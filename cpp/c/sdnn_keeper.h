/* The best policy so far, kept while the agent learns on: its weights, in a memory behind two
 * functions, which may be RAM or flash.
 *
 *   static uint8_t memory[SDNN_KEPT_BYTES];
 *   static sdnn_keeper keeper;
 *   sdnn_begin_keeping(&keeper, memory, sdnn_read_memory, sdnn_write_memory, 30);
 *   sdnn_keep(&agent, &keeper, episode_return); // after each episode
 *   action = sdnn_best(&agent, &keeper, observation);
 *
 * It compares blocks of 30 returns here, as `SaveBestAgent(episodes=30)` does in Python.
 *
 * The file that includes this one defines before sdnn_agent and SDNN_N_KEPT, the words of a policy,
 * and after it
 *
 *   sdnn_carry_kept(agent, part)  those bytes of a part that are in the words of its policy
 *   sdnn_scale_of_policy(agent)   what else the policy depends on */
#ifndef SDNN_KEEPER_H
#define SDNN_KEEPER_H

#include "sdnn_image.h"

#define SDNN_KEPT_MAGIC UINT32_C(0x4b4e4453) /* "SDNK" */
#define SDNN_N_RECORD_WORDS 7 /* magic, fingerprint, scale, score in two, length, checksum */
#define SDNN_KEPT_CONTENT (UINT32_C(4) * SDNN_N_KEPT + 4 * SDNN_N_RECORD_WORDS)
/* The bytes of the memory, which are written in parts. */
#define SDNN_KEPT_BYTES \
  ((SDNN_KEPT_CONTENT + SDNN_PART_BYTES - 1) / SDNN_PART_BYTES * SDNN_PART_BYTES)
#define SDNN_LARGEST_SCORE (INT64_C(1) << 42)
#define SDNN_MOST_IN_BLOCK 1000000

/* Writes SDNN_PART_BYTES bytes at an offset of the memory. Offsets ascend, each is written once,
 * and flash is erased at offset 0. Returns whether it could. */
typedef int (*sdnn_writer)(void* context, uint32_t offset, const uint8_t* bytes, uint32_t n);

typedef struct {
  int64_t total, best; /* of the scores of the present block and of the best one */
  void* context;       /* which the functions receive */
  sdnn_reader read;
  sdnn_writer write;
  uint32_t length, n; /* of a block, and of the present one */
  int32_t scale;      /* of the kept values */
  uint8_t is_kept;    /* whether the memory has a policy */
} sdnn_keeper;

static inline void sdnn_carry_kept(sdnn_agent* agent, const sdnn_part* part);
static inline int32_t sdnn_scale_of_policy(const sdnn_agent* agent);

/* Writes to RAM: the writer to pass if the memory is no flash. */
static inline int sdnn_write_memory(void* context, uint32_t offset, const uint8_t* bytes,
                                    uint32_t n) {
  uint8_t* const memory = (uint8_t*)context + offset;
  uint32_t i;
  for (i = 0; i < n; ++i) memory[i] = bytes[i];
  return 1;
}

/* Moves the words behind the kept weights. */
static inline void sdnn_carry_record(const sdnn_part* part, uint32_t* record, int reads) {
  sdnn_carry_words(part, record, UINT32_C(4) * SDNN_N_KEPT, SDNN_N_RECORD_WORDS, reads);
}

/* Finds the policy that the memory has. Returns whether it is undamaged and one of this agent. */
static inline int sdnn_find_kept(sdnn_keeper* keeper) {
  uint8_t bytes[SDNN_PART_BYTES];
  uint32_t record[SDNN_N_RECORD_WORDS], crc = UINT32_MAX;
  sdnn_part part;
  sdnn_clear(record, sizeof record);
  part.bytes = bytes;
  keeper->is_kept = 0;
  for (part.offset = 0; part.offset < SDNN_KEPT_CONTENT; part.offset += part.n) {
    part.n = SDNN_KEPT_CONTENT - part.offset;
    if (part.n > SDNN_PART_BYTES) part.n = SDNN_PART_BYTES;
    if (!keeper->read(keeper->context, part.offset, bytes, part.n)) return 0;
    crc = sdnn_add_to_checksum(crc, bytes, part.n);
    sdnn_carry_record(&part, record, 1);
  }
  if (crc != SDNN_UNDAMAGED || record[0] != SDNN_KEPT_MAGIC || record[1] != SDNN_FINGERPRINT) {
    return 0;
  }
  keeper->scale = sdnn_signed(record[2]);
  keeper->best = sdnn_signed(record[4]) * (INT64_C(1) << 32) + record[3];
  if (record[5] != keeper->length) keeper->best = INT64_MIN; /* the sum of another number */
  keeper->is_kept = 1;
  return 1;
}

/* Begins to compare blocks of `length` scores, 1 to 1,000,000. Returns whether the memory has a
 * policy already, as flash may have; the first block replaces one of blocks of another length. */
static inline int sdnn_begin_keeping(sdnn_keeper* keeper, void* context, sdnn_reader read,
                                     sdnn_writer write, uint32_t length) {
  sdnn_clear(keeper, sizeof *keeper);
  keeper->context = context;
  keeper->read = read;
  keeper->write = write;
  keeper->length = length < SDNN_MOST_IN_BLOCK ? length + !length : SDNN_MOST_IN_BLOCK;
  return sdnn_find_kept(keeper);
}

/* The bytes of a part of the memory. */
static inline void sdnn_put_kept(const sdnn_agent* agent, uint32_t* record, const sdnn_part* part) {
  uint32_t i;
  for (i = 0; i < part->n; ++i) part->bytes[i] = 255;
  sdnn_carry_kept((sdnn_agent*)agent, part);
  sdnn_carry_record(part, record, 0);
}

/* Writes the agent's policy to the memory. Returns whether it can be read again. */
static inline int sdnn_write_kept(const sdnn_agent* agent, sdnn_keeper* keeper) {
  const uint64_t best = (uint64_t)keeper->best;
  uint8_t bytes[SDNN_PART_BYTES];
  uint32_t record[SDNN_N_RECORD_WORDS], crc = UINT32_MAX;
  sdnn_part part;
  record[0] = SDNN_KEPT_MAGIC;
  record[1] = SDNN_FINGERPRINT;
  record[2] = (uint32_t)sdnn_scale_of_policy(agent);
  record[3] = (uint32_t)(best & UINT32_MAX);
  record[4] = (uint32_t)(best >> 32);
  record[5] = keeper->length;
  record[6] = 0;
  part.bytes = bytes;
  for (part.offset = 0; part.offset < SDNN_KEPT_CONTENT - 4; part.offset += part.n) {
    part.n = SDNN_KEPT_CONTENT - 4 - part.offset;
    if (part.n > SDNN_PART_BYTES) part.n = SDNN_PART_BYTES;
    sdnn_put_kept(agent, record, &part);
    crc = sdnn_add_to_checksum(crc, bytes, part.n);
  }
  record[6] = ~crc;
  keeper->is_kept = 0;
  part.n = SDNN_PART_BYTES;
  for (part.offset = 0; part.offset < SDNN_KEPT_BYTES; part.offset += part.n) {
    sdnn_put_kept(agent, record, &part);
    if (!keeper->write(keeper->context, part.offset, bytes, part.n)) return 0;
  }
  return sdnn_find_kept(keeper);
}

/* Adds the return of an episode, or any score. At the end of a block with a larger sum than all
 * before, it keeps the policy. Returns whether it did. */
static inline int sdnn_keep(const sdnn_agent* agent, sdnn_keeper* keeper, int64_t score) {
  const int64_t most = SDNN_LARGEST_SCORE;
  int64_t total;
  keeper->total += score > most ? most : score < -most ? -most : score;
  if (++keeper->n < keeper->length) return 0;
  total = keeper->total;
  keeper->total = 0;
  keeper->n = 0;
  if (keeper->is_kept && total <= keeper->best) return 0;
  keeper->best = total;
  return sdnn_write_kept(agent, keeper);
}

#endif /* SDNN_KEEPER_H */
