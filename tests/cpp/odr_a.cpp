// With odr_b.cpp: every header may be included by two translation units of one program.
#include "sdnn/sdnn.hpp"

std::size_t n_actions_seen_by_a(const sdnn::approximators::SDNNC& network);

std::size_t n_actions_seen_by_a(const sdnn::approximators::SDNNC& network) {
  return network.n_actions();
}
