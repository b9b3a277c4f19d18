#include "sdnn/core/state.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "errors.hpp"
#include "states.hpp"

namespace sdnn::core {
namespace {

struct Inner {
  double value = 0.5;

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("value", self.value);
  }
};

struct Outer {
  int step = 3;
  bool is_on = true;
  std::vector<std::int64_t> list = {1, -2};
  std::array<float, 6> grid{1, 2, 3, 4, 5, 6};
  Inner first, second;

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("step", self.step);
    archive.number("is_on", self.is_on);
    archive.part("first", self.first);
    archive.numbers("list", self.list);
    archive.fixed("grid", {2, 3}, self.grid);
    archive.part("second", self.second);
    if constexpr (Archive::kReads) archive.expect(self.step >= 0, "step", "0 or more");
  }
};

using Names = std::vector<std::string>;

// Outer has the numbers step = 3, is_on, list and grid, and the parts first and second.
TEST(State, HasATensorForEveryMemberInOrderOfNames) {
  const State state = state_of(Outer{});
  Names names;
  for (const auto& [name, tensor] : state) names.push_back(name);
  EXPECT_EQ(names, (Names{"first.value", "grid", "is_on", "list", "second.value", "step"}));
  const Tensor& step = state.at("step");
  EXPECT_EQ(step.type, TensorType::i32);
  EXPECT_EQ(step.shape, std::vector<std::size_t>{});
  EXPECT_EQ(step.bytes,
            (std::vector<std::byte>{std::byte{3}, std::byte{0}, std::byte{0}, std::byte{0}}));
  EXPECT_EQ(step.size(), 1U);
  EXPECT_EQ(state.at("is_on").type, TensorType::u8);
  EXPECT_EQ(state.at("list").shape, std::vector<std::size_t>{2});
  EXPECT_EQ(state.at("grid").type, TensorType::f32);
  EXPECT_EQ(state.at("grid").shape, (std::vector<std::size_t>{2, 3}));
  EXPECT_EQ(state.at("grid").size(), 6U);
  EXPECT_EQ(testing::number_of<float>(state, "grid", 4), 5.0F);
}

TEST(State, RestoresEveryMember) {
  Outer changed;
  changed.step = 8;
  changed.is_on = false;
  changed.list = {7, 8, 9};
  changed.grid[5] = -1.0F;
  changed.second.value = testing::kNaN;
  Outer restored;
  restore(restored, state_of(changed));
  EXPECT_EQ(restored.step, 8);
  EXPECT_FALSE(restored.is_on);
  EXPECT_EQ(restored.list, changed.list);
  EXPECT_EQ(restored.grid, changed.grid);
  EXPECT_EQ(restored.first.value, 0.5);
  EXPECT_EQ(state_of(restored), state_of(changed));  // the bits of a NaN too
  changed.list.clear();
  restore(restored, state_of(changed));
  EXPECT_TRUE(restored.list.empty());
}

TEST(State, RefusesInconsistentTensorsAndChangesNothing) {
  Outer object;
  testing::expect_damaged_states_refused(object);
  const State good = state_of(object);
  testing::expect_refused(object, testing::with_number(good, "step", -1),
                          "state: step must be 0 or more");
  testing::expect_refused(object, testing::with_number(good, "is_on", std::uint8_t{2}),
                          "state: is_on must be 0 or 1");
  State bad = good;
  bad["grid"].shape = {3, 2};
  testing::expect_refused(object, bad, "state: grid must be of shape (2, 3, )");
  bad = good;
  bad["list"].shape = {1, 2};
  testing::expect_refused(object, bad, "state: list must be of one dimension");
  bad["list"].shape = {0, 7};
  testing::expect_refused(object, bad, "state: list must be as large as its shape");
}

/// A number that may be missing, and parts that are numbered from 1.
struct OptionalParts {
  std::optional<double> limit;
  std::vector<Inner> others;

  template <class Self, class Archive>
  static void serialize(Self& self, Archive& archive) {
    archive.number("limit", self.limit);
    if constexpr (Archive::kReads) self.others.resize(archive.n_numbered("other"));
    for (std::size_t i = 0; i < self.others.size(); ++i) {
      archive.within("other." + std::to_string(i + 1),
                     [&] { Inner::serialize(self.others[i], archive); });
    }
  }
};

TEST(State, OmitsMissingOptionalMembersAndRestoresNumberedParts) {
  OptionalParts none;
  EXPECT_TRUE(state_of(none).empty());
  OptionalParts some{2.5, std::vector<Inner>(11)};
  some.others[9].value = 7.0;
  const State state = state_of(some);
  EXPECT_EQ(state.size(), 1U + 11);  // the limit and 11 parts, other.1 to other.11
  EXPECT_EQ(testing::number_of<double>(state, "other.10.value"), 7.0);
  OptionalParts restored{1.0, std::vector<Inner>(2)};
  restore(restored, state);
  EXPECT_EQ(restored.limit, 2.5);
  EXPECT_EQ(state_of(restored), state);
  restore(restored, state_of(none));
  EXPECT_EQ(restored.limit, std::nullopt);
  EXPECT_TRUE(restored.others.empty());
  State bad = state;
  bad.erase("other.4.value");  // three parts are left: the next name in order is other.10's
  testing::expect_refused(restored, bad, "state: other.10.value must not be there");
}

// naming(name, use) calls use, and adds the tensor's name to the message of its error.
TEST(StateReader, NamesTheTensorThatCouldNotBeRestored) {
  const State state;
  StateReader reader(state);
  reader.prefix = "net.";
  EXPECT_NO_THROW(reader.naming("weights", [] {}));
  const auto bad = [] { throw std::invalid_argument("weight must be small, got 9"); };
  EXPECT_EQ(testing::message_of([&] { reader.naming("weights", bad); }),
            "state: net.weights must be such that weight must be small, got 9");
}

TEST(Tensor, TypesHaveTheNamesAndSizesOfSafetensors) {
  EXPECT_STREQ(facts_of(tensor_type<std::int8_t>()).name, "I8");
  EXPECT_STREQ(facts_of(tensor_type<std::uint8_t>()).name, "U8");
  EXPECT_STREQ(facts_of(tensor_type<std::int16_t>()).name, "I16");
  EXPECT_STREQ(facts_of(tensor_type<std::uint64_t>()).name, "U64");
  EXPECT_STREQ(facts_of(tensor_type<double>()).name, "F64");
  EXPECT_EQ(facts_of(TensorType::i16).n_bytes, sizeof(std::int16_t));
  EXPECT_EQ(facts_of(TensorType::i32).n_bytes, sizeof(std::int32_t));
  EXPECT_EQ(facts_of(TensorType::f32).n_bytes, sizeof(float));
}

}  // namespace
}  // namespace sdnn::core
