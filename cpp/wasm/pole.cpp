/// CartPole in a browser, learned by agents for microcontrollers: the C headers pole1, pole2 and
/// pole3, which `sdnn export --new` has written, are for observations in which each of the four
/// sensors is there 1, 2 or 3 times. The page calls the exported functions.
#include <cmath>
#include <cstdint>

#include "pole1.h"
#include "pole2.h"
#include "pole3.h"

namespace {

static_assert(POLE1_FRACTION_BITS == 16 && POLE2_FRACTION_BITS == 16 && POLE3_FRACTION_BITS == 16);

constexpr int kMaxSteps = 500;     // of an episode
constexpr int kLearned = 4;        // learning episodes between two greedy test episodes
constexpr double kUnit = 65536.0;  // the agents take fixed-point numbers with 16 fraction bits
constexpr double kPi = 3.141592653589793;

/// Random numbers for starts and sensor noise, by Marsaglia's xorshift with shifts 13, 7, 17.
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

/// The dynamics of Gymnasium's CartPole-v1: a pole on a cart.
struct CartPole {
  static constexpr double kMaxPosition = 2.4;
  static constexpr double kMaxAngle = 12.0 * kPi / 180.0;

  double state[4] = {};  // position (m), speed (m/s), angle (rad), angular speed (rad/s)

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

/// The world of the agent at work: the pole, a hand that pushes the cart, and the course of
/// episodes.
struct World {
  CartPole pole;
  Random random;
  double noise = 0.0;    // standard deviation, as a share of the range that a sensor usually has
  double hand = 0.0;     // the force of the hand, N
  int n_steps = 0;       // in the present episode
  int n_episodes = 0;    // episodes that have ended
  int last_length = 0;   // steps of the last of them
  int last_is_test = 0;  // 1 if it was a test episode, else 0
} world;

/// An agent that balances the pole. Each of its four sensors is there `kCopies` times, with
/// separate noise.
template <class Learner, int kCopies>
class Balancer {
 public:
  /// Begins anew with an agent that has learned nothing.
  void begin() {
    learner_ = Learner();
    begin_episode();
  }

  /// Makes a step of 20 ms, of which the agent learns unless the episode is a test.
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

  /// Writes the noisy readings of all sensors, in units of 2^-16.
  void observe(std::int32_t (&observation)[4 * kCopies]) {
    constexpr double kRanges[4] = {2.4, 3.0, 0.21, 3.5};  // usual magnitudes of the state's numbers
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

/// Begins anew with an agent that has learned nothing, for sensors that are there `n_copies` times
/// (1 to 3).
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

/// Makes a step; returns 1 if it was the last of an episode, else 0.
__attribute__((export_name("step"))) int step() {
  const int before = world.n_episodes;
  if (copies == 1) single.step();
  if (copies == 2) twofold.step();
  if (copies == 3) threefold.step();
  return world.n_episodes > before ? 1 : 0;
}

/// Sets the standard deviation of sensor noise, as a share of a sensor's usual range.
__attribute__((export_name("set_noise"))) void set_noise(double noise) { world.noise = noise; }
/// Sets the force (N) with which the hand pushes the cart until the next call.
__attribute__((export_name("push"))) void push(double force) { world.hand = force; }
__attribute__((export_name("position"))) double position() { return world.pole.state[0]; }
__attribute__((export_name("angle"))) double angle() { return world.pole.state[2]; }
__attribute__((export_name("n_steps"))) int n_steps() { return world.n_steps; }
__attribute__((export_name("last_length"))) int last_length() { return world.last_length; }
/// 1 if the last episode was a test, in which the agent is greedy and learns nothing, else 0.
__attribute__((export_name("last_is_test"))) int last_is_test() { return world.last_is_test; }
/// The number of bytes of the agent's struct, which has all of its memory.
__attribute__((export_name("agent_bytes"))) int agent_bytes() {
  return static_cast<int>(copies == 1   ? sizeof(pole1_agent)
                          : copies == 2 ? sizeof(pole2_agent)
                                        : sizeof(pole3_agent));
}
}
