/// Workspaces for calls from Python that read a network.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>

namespace sdnn::bindings {

/// Returns the calling thread's workspace for a network. A thread keeps the workspaces of the eight
/// networks (a chosen number) that it used last, so that values of a repeated state are cheap.
template <class Network>
typename Network::Workspace& workspace_of(const Network& network) {
  constexpr std::size_t kKept = 8;
  struct Kept {
    std::uint64_t network;
    typename Network::Workspace workspace;
  };
  thread_local std::list<Kept> kept;  // the last used network comes first
  const auto found =
      std::ranges::find(kept, network.identity(), [](const Kept& entry) { return entry.network; });
  if (found != kept.end()) {
    kept.splice(kept.begin(), kept, found);
  } else {
    kept.push_front({network.identity(), network.workspace()});
    if (kept.size() > kKept) kept.pop_back();
  }
  return kept.front().workspace;
}

}  // namespace sdnn::bindings
