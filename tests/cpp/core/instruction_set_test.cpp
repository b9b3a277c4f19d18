#include "sdnn/core/instruction_set.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "errors.hpp"

namespace sdnn::core {
namespace {

TEST(InstructionSet, AvailableLevelsCanBeSelectedAndOthersAreRefused) {
  const InstructionSet before = instruction_set();
  for (const auto level : kInstructionSets) {
    if (offers(level)) {
      set_instruction_set(name_of(level));
      EXPECT_EQ(instruction_set(), level);
    } else {
      EXPECT_THROW(set_instruction_set(name_of(level)), std::invalid_argument);
    }
  }
  set_instruction_set(name_of(before));
}

TEST(InstructionSet, RefusalsNameTheSourceAndAllAcceptedLevels) {
  std::string accepted;
  for (const auto level : kInstructionSets) {
    if (offers(level)) accepted.append(accepted.empty() ? "" : ", ").append(name_of(level));
  }
  // No processor offers both neon and avx2, so at least one of them is refused.
  for (const std::string name : {"sse9", "neon", "avx2"}) {
    if (accepted.find(name) != std::string::npos) continue;
    const std::string expected = " must be one of " + accepted + " on this processor, got " + name;
    EXPECT_EQ(testing::message_of([&] { set_instruction_set(name); }),
              "instruction set" + expected);
    EXPECT_EQ(testing::message_of([&] { instruction_set_named(name, "SDNN_INSTRUCTION_SET"); }),
              "SDNN_INSTRUCTION_SET" + expected);
  }
}

}  // namespace
}  // namespace sdnn::core
