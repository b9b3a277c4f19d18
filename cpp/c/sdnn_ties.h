/* Which of several best actions is taken. Define the type sdnn_score before. */
#ifndef SDNN_TIES_H
#define SDNN_TIES_H

#include <stdint.h>

#define SDNN_LOWEST 0 /* the lowest action */
#define SDNN_MIDDLE 1 /* the middle of the widest run of neighbours */
#define SDNN_DRAWN 2  /* any of them, at random */

/* An action whose score is `least` or more. Requires that there is one. */
#if SDNN_TIES == SDNN_DRAWN
static inline uint32_t sdnn_tied(const sdnn_score* scores, uint32_t n_actions, sdnn_score least,
                                 sdnn_random* random) {
  uint32_t action, n_tied = 0, skip = 0;
  for (action = 0; action < n_actions; ++action) n_tied += scores[action] >= least;
  if (n_tied > 1) skip = (uint32_t)sdnn_below(random, n_tied);
  for (action = 0;; ++action) {
    if (scores[action] >= least && skip-- == 0) return action;
  }
}
#elif SDNN_TIES == SDNN_MIDDLE
static inline uint32_t sdnn_tied(const sdnn_score* scores, uint32_t n_actions, sdnn_score least) {
  uint32_t action, run = 0, widest = 0, middle = 0;
  for (action = 0; action < n_actions; ++action) {
    run = scores[action] >= least ? run + 1 : 0;
    if (run > widest) {
      widest = run;
      middle = action - run / 2;
    }
  }
  return middle;
}
#else
static inline uint32_t sdnn_tied(const sdnn_score* scores, uint32_t n_actions, sdnn_score least) {
  uint32_t action = 0;
  (void)n_actions;
  while (scores[action] < least) ++action;
  return action;
}
#endif

#endif /* SDNN_TIES_H */
