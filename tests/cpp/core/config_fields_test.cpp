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
  std::string names;
  std::apply([&](const auto&... field) { ((names += std::string(field.name) + " "), ...); },
             Learning::fields());
  EXPECT_EQ(names, "n_steps epsilon ");
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
