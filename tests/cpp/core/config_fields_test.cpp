#include "sdnn/core/config_fields.hpp"

#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <type_traits>

namespace sdnn::core {
namespace {

struct Policy {
  double epsilon = 0.1;

  static constexpr auto fields() noexcept {
    return std::tuple(field("epsilon", &Policy::epsilon, "Probability.", within(0, 1)));
  }
};

struct Learning {
  int n_steps = 3;
  Policy policy = {};

  static constexpr auto fields() noexcept {
    return std::tuple_cat(std::tuple(field("n_steps", &Learning::n_steps, "Steps.", at_least(1))),
                          nested_fields(&Learning::policy));
  }
};

TEST(ConfigFields, ListMembersAndNestedMembersInOrder) {
  const auto [first, second] = Learning::fields();
  EXPECT_EQ(std::string(first.name), "n_steps");
  EXPECT_EQ(std::string(second.name), "epsilon");
}

TEST(ConfigFields, ReadAndWriteTheMembers) {
  Learning config;
  const auto [n_steps, epsilon] = Learning::fields();
  EXPECT_EQ(n_steps.of(std::as_const(config)), config.n_steps);
  epsilon.of(config) = 0.5;
  EXPECT_EQ(config.policy.epsilon, 0.5);
  static_assert(std::is_same_v<FieldValue<decltype(epsilon), Learning>, double>);
}

}  // namespace
}  // namespace sdnn::core
