// Any bytes as a file of tensors; what could be read is read again the same after being written.
#include "input.hpp"
#include "sdnn/core/safetensors.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sdnn;
  fuzz::accepted([&] {
    const fuzz::MemoryFile file({data, size});
    const core::Safetensors content = core::read_safetensors(file.path());
    const std::string copy = "/dev/shm/sdnn_fuzz_" + std::to_string(::getpid());
    if (!fuzz::accepted([&] { core::write_safetensors(copy, content); })) return;
    const core::Safetensors again = core::read_safetensors(copy);
    ::unlink(copy.c_str());
    fuzz::expect(again.metadata == content.metadata, "metadata changed");
    fuzz::expect(again.tensors.size() == content.tensors.size(), "tensors were lost");
    for (const auto& [name, tensor] : content.tensors) {
      fuzz::expect(again.tensors.at(name).bytes == tensor.bytes, "a tensor changed");
    }
  });
  return 0;
}
