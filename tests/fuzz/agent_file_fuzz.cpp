// Any bytes as a saved agent: if it loads, it acts, learns and can be saved.
#include <algorithm>
#include <cmath>

#include "input.hpp"
#include "sdnn/agents/agent_file.hpp"

namespace {

/// Returns the bytes with the right checksum at its place, so that the reader gets beyond it.
std::vector<std::uint8_t> with_checksum(std::vector<std::uint8_t> file) {
  using namespace sdnn::core::detail;
  if (file.size() < kChecksumEnd) return file;
  std::ranges::copy(kBeginning, file.begin() + sizeof(std::uint64_t));
  std::ranges::copy(checksum_of(file.size(), sdnn::fuzz::reader_of(file)),
                    file.begin() + kChecksumBegin);
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sdnn;
  fuzz::accepted([&] {
    const fuzz::MemoryFile file(with_checksum({data, data + size}));
    agents::AgentFile saved(file.path());
    agents::Controller& controller = saved.controller;
    const std::vector<double> observation(controller.n_variables(), 0.25);
    controller.begin_episode();
    for (int step = 0; step < 3; ++step) {
      const auto chosen = controller.act(observation);
      const std::vector<double> action(chosen.begin(), chosen.end());
      for (const double component : action) {
        fuzz::expect(!std::isnan(component), "an action is no number");
      }
      controller.learn(observation, action, 1.0, observation, step == 2);
    }
    const std::string copy = "/dev/shm/sdnn_fuzz_" + std::to_string(::getpid());
    saved.write(copy);
    const agents::AgentFile loaded_copy(copy);
    ::unlink(copy.c_str());
  });
  return 0;
}
