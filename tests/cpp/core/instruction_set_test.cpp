#include "sdnn/core/instruction_set.hpp"

#include <gtest/gtest.h>

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

TEST(InstructionSet, AnUnknownNameIsRefusedWithThePossibleOnes) {
  EXPECT_EQ(testing::message_of([] { set_instruction_set("sse9"); }),
            "instruction set must be portable, neon, avx2 or avx512, got sse9");
}

}  // namespace
}  // namespace sdnn::core
