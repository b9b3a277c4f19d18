// Any bytes as a file of tensors: tensors that can be read are the same after they were written and
// read again.
#include "input.hpp"
#include "sdnn/core/safetensors.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sdnn;
  fuzz::accepted([&] {
    const core::detail::Safetensors parsed =
        core::detail::parse_safetensors(size, fuzz::reader_of({data, size}));
    const std::string copy = "/dev/shm/sdnn_fuzz_" + std::to_string(::getpid());
    const auto write = [&] {
      core::write_file(copy, {"agent", {{"about", parsed.about}}, parsed.tensors});
    };
    if (!fuzz::accepted(write)) return;
    const core::FileContent again = core::read_file(copy, {"agent"});
    ::unlink(copy.c_str());
    fuzz::expect(again.description["about"] == parsed.about, "metadata changed");
    fuzz::expect(again.tensors == parsed.tensors, "tensors changed");
  });
  return 0;
}
