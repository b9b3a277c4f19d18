#include "sdnn/core/safetensors.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "folders.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::core {
namespace {

/// A file of this header and data.
std::string file_of(const std::string& header, const std::string& data) {
  std::string length(8, '\0');
  for (std::size_t i = 0; i < 8; ++i) {
    length[i] = static_cast<char>(static_cast<std::uint64_t>(header.size()) >> (8 * i) & 0xff);
  }
  return length + header + data;
}

const std::string kHeader =
    R"({"__metadata__":{"key":"text \"é\""},"b":{"dtype":"F64","shape":[1],"data_offsets":[0,8]},)"
    R"("a":{"dtype":"I16","shape":[2,1],"data_offsets":[8,12]},)"
    R"("c":{"dtype":"U8","shape":[],"data_offsets":[12,13]},)"
    R"("d":{"dtype":"U8","shape":[0,3],"data_offsets":[13,13]}})";
const std::string kData =
    std::string("\0\0\0\0\0\0\xf8\x3f", 8) + std::string("\x01\0\xff\xff\x07", 5);

Safetensors example() {
  Safetensors content;
  content.metadata["key"] = "text \"é\"";
  content.tensors["a"] = testing::tensor_of<std::int16_t>({1, -1});
  content.tensors["a"].shape = {2, 1};
  content.tensors["b"] = testing::tensor_of<double>({1.5});
  content.tensors["c"] = testing::tensor_of<std::uint8_t>({7});
  content.tensors["c"].shape = {};
  content.tensors["d"] = testing::tensor_of<std::uint8_t>({});
  content.tensors["d"].shape = {0, 3};
  return content;
}

// Byte by byte as the format's own library writes it: larger types first, then by name.
TEST(Safetensors, AreWrittenAsByTheirOwnLibrary) {
  const testing::Folder folder;
  write_safetensors(folder / "file", example());
  std::string header = kHeader;
  header.append((8 - header.size() % 8) % 8, ' ');
  EXPECT_EQ(testing::content_of(folder / "file"), file_of(header, kData));
  EXPECT_EQ(folder.n_files(), 1U);
}

TEST(Safetensors, AreReadAsTheyWereWritten) {
  const testing::Folder folder;
  for (const Safetensors& content : {example(), Safetensors{}}) {
    write_safetensors(folder / "file", content);
    const Safetensors read = read_safetensors(folder / "file");
    EXPECT_EQ(read.metadata, content.metadata);
    EXPECT_EQ(read.tensors, content.tensors);
  }
}

TEST(Safetensors, SayWhatIsWrongWithAFile) {
  const testing::Folder folder;
  const auto path = folder / "file";
  const auto error_of = [&path](const std::string& content) {
    testing::write_content(path, content);
    const std::string error = testing::runtime_error_of([&] { (void)read_safetensors(path); });
    EXPECT_EQ(error.rfind(path.string() + ": ", 0), 0U) << error;
    return error.substr(path.string().size() + 2);
  };
  const auto with = [&](const std::string& part, const std::string& other) {
    std::string header = kHeader;
    EXPECT_NE(header.find(part), std::string::npos) << part;
    return error_of(file_of(header.replace(header.find(part), part.size(), other), kData));
  };
  EXPECT_EQ(error_of(""), "is too short to be a safetensors file");
  EXPECT_EQ(error_of("1234567"), "is too short to be a safetensors file");
  EXPECT_EQ(error_of("not such a file, but longer than 8 bytes").rfind("is no safetensors file", 0),
            0U);
  EXPECT_EQ(error_of(file_of("[1]", "")), "is no safetensors file: its header is no JSON object");
  EXPECT_EQ(error_of(file_of("{\"a\":", "")).rfind("its JSON is damaged: ", 0), 0U);
  EXPECT_EQ(error_of(file_of("{\"\xff\":1}", "")).rfind("its JSON is damaged: ", 0), 0U);
  EXPECT_EQ(error_of(file_of("{\"a\":" + std::string(1000000, '['), "")), "its JSON is too deep");
  std::string many = "{\"a\":[1";
  for (int i = 0; i < 1000000; ++i) many += ",1";
  EXPECT_EQ(error_of(file_of(many + "]}", "")), "its JSON has too many values");
  EXPECT_EQ(with("\"b\"", "\"a\""), "its JSON has \"a\" twice");
  EXPECT_EQ(error_of(file_of(kHeader, kData + "x")),
            "has 1 bytes after its last tensor, or lost one");
  EXPECT_EQ(error_of(file_of(kHeader, kData.substr(1))),
            "tensor c reaches beyond the end of the file");
  EXPECT_EQ(with("F64", "F65"), "tensor b has a dtype that is not known");
  EXPECT_EQ(with("\"F64\"", "64"), "tensor b has a dtype that is not known");
  EXPECT_EQ(with("[0,8]", "[0,12]"), "tensor b is not as large as its shape");
  EXPECT_EQ(with("[0,8]", "[8,0]"), "tensor b reaches beyond the end of the file");
  EXPECT_EQ(with("[0,8]", "[0,18446744073709551615]"),
            "tensor b reaches beyond the end of the file");
  EXPECT_EQ(with("[0,8]", "[0,-8]"), "tensor b has no data_offsets of two numbers");
  EXPECT_EQ(with("[0,8]", "[0,8,9]"), "tensor b has no data_offsets of two numbers");
  EXPECT_EQ(with("[0,8]", "[4,12]"), "tensor b leaves a gap or overlaps another");
  EXPECT_EQ(with("[8,12]", "[0,4]"), "tensor b leaves a gap or overlaps another");
  EXPECT_EQ(with("[2,1]", "[2.0,1]"), "tensor a has no shape of numbers");
  EXPECT_EQ(with("[2,1]", "[2,3]"), "tensor a is not as large as its shape");
  EXPECT_EQ(with("[2,1]", "[0]"), "tensor a is not as large as its shape");
  EXPECT_EQ(with("[2,1]", "[4294967296,4294967296,4294967296,4]"),
            "tensor a is not as large as its shape");
  EXPECT_EQ(with("\"shape\":[1],", ""), "tensor b needs dtype, shape and data_offsets");
  EXPECT_EQ(with("{\"key\":\"text \\\"é\\\"\"}", "[]"), "has __metadata__ that are no JSON object");
  EXPECT_EQ(with("\"text \\\"é\\\"\"", "3"), "has __metadata__ that are no text: key");
}

TEST(Safetensors, SayWhatIsNoFile) {
  const testing::Folder folder;
  const auto error_of = [](const std::filesystem::path& path) {
    return testing::runtime_error_of([&] { (void)read_safetensors(path); });
  };
  EXPECT_EQ(error_of(folder / "nothing"), (folder / "nothing").string() + ": is not there");
  std::filesystem::create_directory(folder / "inside");
  EXPECT_EQ(error_of(folder / "inside"), (folder / "inside").string() + ": is no file");
}

// Nothing but a content or std::runtime_error comes of any damage.
TEST(Safetensors, NoDamageGivesAnythingElse) {
  const testing::Folder folder;
  const std::string good = file_of(kHeader, kData);
  Random random(1, Stream::weights);
  int n_refused = 0;
  for (std::size_t i = 0; i < good.size() + 3000; ++i) {
    std::string bad = good;
    if (i < good.size()) {
      bad.resize(i);  // cut anywhere
    } else {
      bad[random.below(bad.size())] = static_cast<char>(random.below(256));
    }
    testing::write_content(folder / "file", bad);
    n_refused +=
        testing::runtime_error_of([&] { (void)read_safetensors(folder / "file"); }) != "no error";
  }
  EXPECT_GT(n_refused, static_cast<int>(good.size()) + 1000);
}

}  // namespace
}  // namespace sdnn::core
