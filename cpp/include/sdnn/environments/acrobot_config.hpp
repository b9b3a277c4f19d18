/// The numbers of the acrobot's swing-up task.
#pragma once

#include <tuple>

#include "sdnn/core/config_fields.hpp"
#include "sdnn/core/elementary.hpp"

namespace sdnn::environments {

/// When the goal is looked for; the paper is silent.
enum class GoalTest {
  every_step,        ///< after every integration step: the episode ends at that instant
  decision_instant,  ///< only when the next decision is due
};

/// The task's numbers; the defaults are the paper's.
struct AcrobotConfig {
  double link_mass_1 = 1.0;                  ///< kg
  double link_mass_2 = 1.0;                  ///< kg
  double link_length_1 = 1.0;                ///< m
  double link_length_2 = 1.0;                ///< m
  double center_of_mass_1 = 0.5;             ///< m from joint 1
  double center_of_mass_2 = 0.5;             ///< m from joint 2
  double inertia_1 = 1.0;                    ///< kg m^2, about the link's centre of mass
  double inertia_2 = 1.0;                    ///< kg m^2
  double gravity = 9.8;                      ///< m/s^2
  double max_torque = 10.0;                  ///< N m
  double decision_interval = 1.0;            ///< s, the torque is held for it
  double integration_step = 0.02;            ///< s, a whole fraction of decision_interval
  int max_decisions = 50;                    ///< in an episode
  double goal_height = 1.5;                  ///< m, of the tip above joint 1
  double goal_velocity_1 = 3.0 * core::kPi;  ///< rad/s; times the goal tolerance for the goal,
  double goal_velocity_2 = 5.0 * core::kPi;  ///< rad/s; as it is for the penalty
  GoalTest goal_test = GoalTest::every_step;
  double goal_reward = 10.0;
  double penalty = -5.0;                 ///< for idling or too much speed; ends nothing
  double idle_angle = core::kPi / 36.0;  ///< rad: |theta1| below it is idling; 0 = never

  static constexpr auto fields() noexcept {
    return std::tuple(core::field("link_mass_1", &AcrobotConfig::link_mass_1),
                      core::field("link_mass_2", &AcrobotConfig::link_mass_2),
                      core::field("link_length_1", &AcrobotConfig::link_length_1),
                      core::field("link_length_2", &AcrobotConfig::link_length_2),
                      core::field("center_of_mass_1", &AcrobotConfig::center_of_mass_1),
                      core::field("center_of_mass_2", &AcrobotConfig::center_of_mass_2),
                      core::field("inertia_1", &AcrobotConfig::inertia_1),
                      core::field("inertia_2", &AcrobotConfig::inertia_2),
                      core::field("gravity", &AcrobotConfig::gravity),
                      core::field("max_torque", &AcrobotConfig::max_torque),
                      core::field("decision_interval", &AcrobotConfig::decision_interval),
                      core::field("integration_step", &AcrobotConfig::integration_step),
                      core::field("max_decisions", &AcrobotConfig::max_decisions),
                      core::field("goal_height", &AcrobotConfig::goal_height),
                      core::field("goal_velocity_1", &AcrobotConfig::goal_velocity_1),
                      core::field("goal_velocity_2", &AcrobotConfig::goal_velocity_2),
                      core::field("goal_test", &AcrobotConfig::goal_test),
                      core::field("goal_reward", &AcrobotConfig::goal_reward),
                      core::field("penalty", &AcrobotConfig::penalty),
                      core::field("idle_angle", &AcrobotConfig::idle_angle));
  }
  bool operator==(const AcrobotConfig&) const = default;
};

}  // namespace sdnn::environments
