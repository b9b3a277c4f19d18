/// CartPole for a browser: agents that learn on microcontrollers, in the C headers that
/// `sdnn export --new` writes, for sensors with 1, 2 and 3 copies. The page calls the exported
/// functions.
#include <cmath>
#include <cstdint>

#include "pole1.h"
#include "pole2.h"
#include "pole3.h"

namespace {

static_assert(POLE1_FRACTION_BITS == 16 && POLE2_FRACTION_BITS == 16 && POLE3_FRACTION_BITS == 16);

constexpr int kMaxSteps = 500;  // of an episode
constexpr int kLearned = 4;     // episodes that are learned from before a greedy test episode
constexpr double kUnit = 65536.0;
constexpr double kPi = 3.141592653589793;

/// Uniform and normal random numbers, for starts and sensors.
class Random {
 public:
  void seed(std::uint32_t seed) { state_ = 0x9e3779b97f4a7c15U * (seed + 1U); }
  double uniform() {
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 7U;
    state_ ^= state_ << 17U;
    return static_cast<double>(state_ >> 11U) * 0x1p-53;
  }
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * kPi * uniform());
  }

 private:
  std::uint64_t state_ = 1;
};

/// The pole on a cart of Gymnasium's CartPole-v1, and a hand that pushes the cart.
struct CartPole {
  static constexpr double kMaxPosition = 2.4;
  static constexpr double kMaxAngle = 12.0 * kPi / 180.0;

  double state[4] = {};  // position, speed, angle, angular speed

  void reset(Random& random) {
    for (double& value : state) value = 0.1 * random.uniform() - 0.05;
  }

  /// Applies a force (N) for 20 ms; returns whether the pole fell or the cart left the track.
  bool step(double force) {
    constexpr double kGravity = 9.8, kPoleMass = 0.1, kMass = 1.1, kHalfLength = 0.5;
    constexpr double kSeconds = 0.02;
    const double sine = std::sin(state[2]), cosine = std::cos(state[2]);
    const double share = (force + kPoleMass * kHalfLength * state[3] * state[3] * sine) / kMass;
    const double angular_acceleration =
        (kGravity * sine - cosine * share) /
        (kHalfLength * (4.0 / 3.0 - kPoleMass * cosine * cosine / kMass));
    const double acceleration =
        share - kPoleMass * kHalfLength * angular_acceleration * cosine / kMass;
    state[0] += kSeconds * state[1];
    state[1] += kSeconds * acceleration;
    state[2] += kSeconds * state[3];
    state[3] += kSeconds * angular_acceleration;
    return std::abs(state[0]) > kMaxPosition || std::abs(state[2]) > kMaxAngle;
  }
};

/// The world around the agents: its state is shared by all of them.
struct World {
  CartPole pole;
  Random random;
  double noise = 0.0;  // standard deviation, as a share of the range that a sensor usually has
  double hand = 0.0;   // the force of the hand, N
  int n_steps = 0;     // in the present episode
  int n_episodes = 0;  // that ended
  int last_length = 0;
  int last_is_test = 0;
} world;

/// An agent whose four sensors are there `kCopies` times, each with separate noise.
template <class Learner, int kCopies>
class Balancer {
 public:
  void begin() {
    learner_ = Learner();
    begin_episode();
  }

  void step() {
    const bool is_test = world.n_episodes % (kLearned + 1) == kLearned;
    const std::uint32_t action = is_test ? learner_.greedy(observed_) : learner_.act(observed_);
    const bool has_fallen = world.pole.step((action == 0 ? -10.0 : 10.0) + world.hand);
    observe(next_);
    if (!is_test) {
      learner_.learn(observed_, action, static_cast<std::int32_t>(kUnit), next_, has_fallen);
    }
    for (int i = 0; i < 4 * kCopies; ++i) observed_[i] = next_[i];
    ++world.n_steps;
    if (!has_fallen && world.n_steps < kMaxSteps) return;
    world.last_length = world.n_steps;
    world.last_is_test = is_test ? 1 : 0;
    ++world.n_episodes;
    begin_episode();
  }

 private:
  void begin_episode() {
    world.n_steps = 0;
    world.pole.reset(world.random);
    learner_.begin_episode();
    observe(observed_);
  }

  void observe(std::int32_t (&observation)[4 * kCopies]) {
    constexpr double kRanges[4] = {2.4, 3.0, 0.21, 3.5};
    for (int i = 0; i < 4 * kCopies; ++i) {
      const double range = kRanges[i % 4];
      const double noisy = world.pole.state[i % 4] + world.noise * range * world.random.normal();
      observation[i] = static_cast<std::int32_t>(std::lround(noisy * kUnit));
    }
  }

  Learner learner_;
  std::int32_t observed_[4 * kCopies] = {};
  std::int32_t next_[4 * kCopies] = {};
};

Balancer<pole1_learner, 1> single;
Balancer<pole2_learner, 2> twofold;
Balancer<pole3_learner, 3> threefold;
int copies = 1;

}  // namespace

extern "C" {

/// Begins with an agent that has learned nothing.
__attribute__((export_name("begin"))) void begin(int n_copies, std::uint32_t seed) {
  copies = n_copies;
  const double noise = world.noise;
  world = {};
  world.noise = noise;
  world.random.seed(seed);
  if (copies == 1) single.begin();
  if (copies == 2) twofold.begin();
  if (copies == 3) threefold.begin();
}

/// Makes a step; returns whether it was the last of an episode.
__attribute__((export_name("step"))) int step() {
  const int before = world.n_episodes;
  if (copies == 1) single.step();
  if (copies == 2) twofold.step();
  if (copies == 3) threefold.step();
  return world.n_episodes > before ? 1 : 0;
}

__attribute__((export_name("set_noise"))) void set_noise(double noise) { world.noise = noise; }
__attribute__((export_name("push"))) void push(double force) { world.hand = force; }
__attribute__((export_name("position"))) double position() { return world.pole.state[0]; }
__attribute__((export_name("angle"))) double angle() { return world.pole.state[2]; }
__attribute__((export_name("n_steps"))) int n_steps() { return world.n_steps; }
__attribute__((export_name("last_length"))) int last_length() { return world.last_length; }
/// Whether the last episode was a test: greedy, and nothing was learned from it.
__attribute__((export_name("last_is_test"))) int last_is_test() { return world.last_is_test; }
/// Bytes of the struct in which the agent keeps everything.
__attribute__((export_name("agent_bytes"))) int agent_bytes() {
  return static_cast<int>(copies == 1   ? sizeof(pole1_agent)
                          : copies == 2 ? sizeof(pole2_agent)
                                        : sizeof(pole3_agent));
}
}
