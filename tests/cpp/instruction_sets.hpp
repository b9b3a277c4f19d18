/// Tests that have to hold on every instruction set.
#pragma once

#include <string>

#include "sdnn/core/instruction_set.hpp"

namespace sdnn::testing {

/// Calls check(name) with each instruction set of this processor in use, one after the other.
template <class Check>
void on_every_instruction_set(const Check& check) {
  const std::string before(core::name_of(core::instruction_set()));
  for (const auto level : core::kInstructionSets) {
    if (!core::offers(level)) continue;
    core::set_instruction_set(core::name_of(level));
    check(core::name_of(level));
  }
  core::set_instruction_set(before);
}

}  // namespace sdnn::testing
