// Any task, torques and states: the batch has the bits of single acrobots, and all results are
// finite.
#include <cmath>
#include <cstddef>

#include "input.hpp"
#include "sdnn/environments/acrobot.hpp"
#include "sdnn/environments/acrobot_batch.hpp"

namespace {

using namespace sdnn;
using environments::AcrobotState;

constexpr std::size_t kAcrobots = 5;

void swing(FuzzedDataProvider& input) {
  environments::AcrobotConfig config;
  config.integration_step = 0.1;  // few steps a decision
  fuzz::change(config, input);
  // More steps are allowed, but take long; NaN does not pass.
  if (!(config.decision_interval / config.integration_step < 1e4)) return;
  std::vector<environments::Acrobot> singles(kAcrobots, environments::Acrobot(config));
  environments::AcrobotBatch batch(config, kAcrobots);
  std::vector<double> rewards(kAcrobots);
  std::vector<std::uint8_t> terminated(kAcrobots), truncated(kAcrobots);
  const std::vector<std::uint8_t> all(kAcrobots, 1);
  while (input.remaining_bytes() > 0) {
    for (std::size_t i = 0; i < kAcrobots; ++i) {
      const auto numbers = fuzz::any_doubles(input, 4, -4.0, 4.0);
      const AcrobotState state(numbers[0], numbers[1], numbers[2], numbers[3]);
      const bool is_set = fuzz::accepted([&] { singles[i].set_state(state); });
      const bool is_set_in_batch = fuzz::accepted([&] { batch.set_state(i, state); });
      fuzz::expect(is_set == is_set_in_batch, "set_state differs");
      if (!is_set) {
        singles[i].reset();
        std::vector<std::uint8_t> mask(kAcrobots);
        mask[i] = 1;
        batch.reset(mask);
      }
    }
    const auto torques = fuzz::any_doubles(input, kAcrobots, -config.max_torque, config.max_torque);
    const auto tolerances = fuzz::any_doubles(input, kAcrobots, 0.0, 1.0);
    const bool is_stepped = fuzz::accepted(
        [&] { batch.step(torques, tolerances, all, {rewards, terminated, truncated}); });
    if (!is_stepped) continue;
    for (std::size_t i = 0; i < kAcrobots; ++i) {
      const auto result = singles[i].step(torques[i], tolerances[i]);
      fuzz::expect(result.reward == rewards[i] && result.terminated == (terminated[i] != 0) &&
                       result.truncated == (truncated[i] != 0) &&
                       singles[i].state() == batch.state(i),
                   "the batch differs from a single acrobot");
      fuzz::expect(batch.state(i).allFinite() && std::isfinite(rewards[i]),
                   "a state or reward is not finite");
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  sdnn::fuzz::accepted([&] { swing(input); });
  return 0;
}
