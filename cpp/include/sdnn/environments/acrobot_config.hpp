/// The configuration of the acrobot's swing-up task.
#pragma once

#include <array>
#include <string_view>
#include <tuple>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::environments {

/// Instants at which the goal is tested; the paper does not define them.
enum class GoalTest {
  every_step,        ///< after every integration step: the episode ends at that instant
  decision_instant,  ///< only when the next decision is due
};
constexpr std::array<std::string_view, 2> words_of(GoalTest) noexcept {
  return {"every_step", "decision_instant"};
}

/// The configuration of the acrobot, its task and the integration; the defaults are the paper's
/// where the paper states them. Units: see fields().
struct AcrobotConfig {
  double link_mass_1 = 1.0;
  double link_mass_2 = 1.0;
  double link_length_1 = 1.0;
  double link_length_2 = 1.0;
  double center_of_mass_1 = 0.5;
  double center_of_mass_2 = 0.5;
  double inertia_1 = 1.0;
  double inertia_2 = 1.0;
  double gravity = 9.8;
  double max_torque = 10.0;
  double decision_interval = 1.0;
  double integration_step = 0.02;
  int max_decisions = 50;
  double goal_height = 1.5;
  double goal_velocity_1 = 3.0 * core::kPi;
  double goal_velocity_2 = 5.0 * core::kPi;
  GoalTest goal_test = GoalTest::every_step;
  double goal_reward = 10.0;
  double penalty = -5.0;
  double idle_angle = core::kPi / 36.0;

  static constexpr auto fields() noexcept {
    return std::tuple(
        core::field("link_mass_1", &AcrobotConfig::link_mass_1, "Mass of link 1, kg.",
                    core::above(0)),
        core::field("link_mass_2", &AcrobotConfig::link_mass_2, "Mass of link 2, kg.",
                    core::above(0)),
        core::field("link_length_1", &AcrobotConfig::link_length_1, "Length of link 1, m.",
                    core::above(0)),
        core::field("link_length_2", &AcrobotConfig::link_length_2, "Length of link 2, m.",
                    core::above(0)),
        core::field("center_of_mass_1", &AcrobotConfig::center_of_mass_1,
                    "Centre of mass of link 1, m from the joint that it hangs on.", core::above(0)),
        core::field("center_of_mass_2", &AcrobotConfig::center_of_mass_2,
                    "Centre of mass of link 2, m from the joint that it hangs on.", core::above(0)),
        core::field("inertia_1", &AcrobotConfig::inertia_1,
                    "Inertia of link 1 about its centre of mass, kg m^2.", core::above(0)),
        core::field("inertia_2", &AcrobotConfig::inertia_2,
                    "Inertia of link 2 about its centre of mass, kg m^2.", core::above(0)),
        core::field("gravity", &AcrobotConfig::gravity, "m/s^2."),
        core::field("max_torque", &AcrobotConfig::max_torque,
                    "N m; the torque is in [-max_torque, max_torque].", core::above(0)),
        core::field("decision_interval", &AcrobotConfig::decision_interval,
                    "s; the torque is held for it.", core::above(0)),
        core::field("integration_step", &AcrobotConfig::integration_step,
                    "s, a whole fraction of decision_interval: Runge-Kutta of fourth order. An "
                    "assumption.",
                    core::above(0)),
        core::field("max_decisions", &AcrobotConfig::max_decisions, "Decisions in an episode.",
                    core::at_least(1)),
        core::field("goal_height", &AcrobotConfig::goal_height,
                    "m above joint 1, which the tip must reach."),
        core::field("goal_velocity_1", &AcrobotConfig::goal_velocity_1,
                    "rad/s. Limit of |theta1_dot|: times the goal tolerance in the goal, as it is "
                    "in the penalty.",
                    core::above(0)),
        core::field("goal_velocity_2", &AcrobotConfig::goal_velocity_2,
                    "rad/s. Limit of |theta2_dot|: times the goal tolerance in the goal, as it is "
                    "in the penalty.",
                    core::above(0)),
        core::field("goal_test", &AcrobotConfig::goal_test,
                    "When the goal is tested: `every_step`: after every integration step, and the "
                    "episode ends there; `decision_instant`: only when the next decision is due. "
                    "An assumption."),
        core::field("goal_reward", &AcrobotConfig::goal_reward, "Reward at the goal."),
        core::field("penalty", &AcrobotConfig::penalty,
                    "Reward for idling or too much speed at a decision instant; it ends nothing."),
        core::field("idle_angle", &AcrobotConfig::idle_angle,
                    "rad: |theta1| below it is idling; 0 turns the rule off. An assumption: 5 "
                    "degrees; pi / 5 is the alternative.",
                    core::within(0, core::kPi)));
  }
  bool operator==(const AcrobotConfig&) const = default;
};

}  // namespace sdnn::environments
