#include "sdnn/core/safetensors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "folders.hpp"
#include "sdnn/core/random.hpp"
#include "states.hpp"

namespace sdnn::core {
namespace {

/// The content of a safetensors file: the header's length in 8 bytes, the header, the data.
std::string file_of(const std::string& header, const std::string& data) {
  std::string length(8, '\0');
  for (std::size_t i = 0; i < 8; ++i) {
    length[i] = static_cast<char>(static_cast<std::uint64_t>(header.size()) >> (8 * i) & 0xff);
  }
  return length + header + data;
}

/// Header and data that the safetensors library writes for example_content() with the metadata
/// "text".
const std::string kHeader =
    R"({"__metadata__":{"sdnn":"text"},"b":{"dtype":"F64","shape":[1],"data_offsets":[0,8]},)"
    R"("a":{"dtype":"I16","shape":[2,1],"data_offsets":[8,12]},)"
    R"("c":{"dtype":"U8","shape":[],"data_offsets":[12,13]},)"
    R"("d":{"dtype":"U8","shape":[0,3],"data_offsets":[13,13]}})";
const std::string kData =
    std::string("\0\0\0\0\0\0\xf8\x3f", 8) + std::string("\x01\0\xff\xff\x07", 5);

/// Reads from a text as from a file.
auto reader_of(const std::string& file) {
  return [&file](std::uint64_t begin, std::span<std::byte> into) {
    const auto bytes = std::as_bytes(std::span(file));
    std::ranges::copy(bytes.subspan(static_cast<std::size_t>(begin), into.size()), into.begin());
  };
}

detail::Safetensors parsed(const std::string& file) {
  return detail::parse_safetensors(file.size(), reader_of(file));
}

FileContent example_content() {
  FileContent content{.kind = "agent", .description = {{"key", "text \"é\""}}, .tensors = {}};
  content.tensors["a"] = testing::tensor_of<std::int16_t>({1, -1});
  content.tensors["a"].shape = {2, 1};
  content.tensors["b"] = testing::tensor_of<double>({1.5});
  content.tensors["c"] = testing::tensor_of<std::uint8_t>({7});
  content.tensors["c"].shape = {};
  content.tensors["d"] = testing::tensor_of<std::uint8_t>({});
  content.tensors["d"].shape = {0, 3};
  return content;
}

// Tensors are ordered by the size of their type, larger ones first, then by name. Our metadata
// replaces "text" in kHeader; headers are padded to a multiple of 8 bytes.
TEST(Files, HaveTheBytesOfTheSafetensorsLibrary) {
  const testing::Folder folder;
  write_file(folder / "file", example_content());
  const std::string file = testing::content_of(folder / "file");
  const std::string checksum = file.substr(detail::kChecksumBegin, 8);
  std::string header = kHeader;
  header.replace(header.find("text"), 4,
                 R"({\"checksum\":\")" + checksum +
                     R"(\",\"description\":{\"key\":\"text \\\"\\u00e9\\\"\"},\"format\":1,)"
                     R"(\"kind\":\"agent\",\"version\":\")" +
                     kVersion + R"(\"})");
  header.append((8 - header.size() % 8) % 8, ' ');
  EXPECT_EQ(file, file_of(header, kData));
  EXPECT_EQ(checksum, detail::checksum_of(file.size(), reader_of(file)));
  EXPECT_EQ(folder.n_files(), 1U);
}

TEST(Files, AreReadAsWritten) {
  const testing::Folder folder;
  for (const FileContent& content :
       {example_content(), FileContent{.kind = "estimator", .tensors = {}}}) {
    write_file(folder / "file", content);
    const FileContent read = read_file(folder / "file", {"agent", "estimator"});
    EXPECT_EQ(read.kind, content.kind);
    EXPECT_EQ(read.description, content.description);
    EXPECT_EQ(read.tensors, content.tensors);
  }
}

// Files that tests/python/reference/agent_files.py wrote.
TEST(Files, FromPythonAreReadAndWrittenByteByByte) {
  const testing::Folder folder;
  for (const std::string name : {"agents/sdnn", "agents/sdnn-symbols", "agents/fuzzy-vector",
                                 "files/training", "files/estimator"}) {
    const std::filesystem::path path(SDNN_TEST_DATA "/" + name + ".safetensors");
    const FileContent content = read_file(path, {"agent", "training", "estimator"});
    write_file(folder / "again", content);
    EXPECT_EQ(testing::content_of(folder / "again"), testing::content_of(path)) << name;
  }
}

TEST(Files, WithAFlippedBitOrTruncatedAreRefused) {
  const testing::Folder folder;
  Random random(1, Stream::weights);
  for (const std::string name : {"agents/sdnn", "files/training", "files/estimator"}) {
    const std::string good = testing::content_of(SDNN_TEST_DATA "/" + name + ".safetensors");
    const auto path = folder / "file";
    const auto is_refused = [&](const std::string& bad) {
      testing::write_content(path, bad);
      const std::string error = testing::runtime_error_of(
          [&] { (void)read_file(path, {"agent", "training", "estimator"}); });
      return error.rfind(path.string() + ": ", 0) == 0;
    };
    EXPECT_FALSE(is_refused(good)) << name;
    for (int i = 0; i < 300; ++i) {
      std::string bad = good;
      // Half of the flips are in the first 200 bytes, a part of the header.
      const std::size_t byte = i < 150 ? random.below(200) : random.below(good.size());
      bad[byte] = static_cast<char>(bad[byte] ^ 1 << random.below(8));
      EXPECT_TRUE(is_refused(bad)) << name << " byte " << byte;
      EXPECT_TRUE(is_refused(good.substr(0, random.below(good.size())))) << name;
    }
    EXPECT_TRUE(is_refused(good + '\0')) << name;
  }
}

TEST(Files, OfAnotherTypeFormatOrProgramAreRefused) {
  const testing::Folder folder;
  const auto path = folder / "file";
  const auto error_of = [&path] {
    const std::string error = testing::runtime_error_of([&] { (void)read_file(path, {"agent"}); });
    EXPECT_EQ(error.rfind(path.string() + ": ", 0), 0U) << error;
    return error.substr(path.string().size() + 2);
  };
  EXPECT_EQ(error_of(), "No such file or directory");
  write_file(path, {"estimator", nlohmann::json::object(), {}});
  EXPECT_EQ(error_of(), "is a file of kind 'estimator', expected agent");
  write_file(path, {"agent", nlohmann::json::array(), {}});
  EXPECT_EQ(error_of(), "is damaged: it has no description");
  const std::string unknown =
      "is not a file of sdnn, is damaged, or was written before files of sdnn had a checksum";
  testing::write_content(path, file_of(kHeader, kData));
  EXPECT_EQ(error_of(), unknown);
  testing::write_content(path, "short");
  EXPECT_EQ(error_of(), unknown);
  std::string newer = file_of(
      std::string(detail::kBeginning) + R"(00000000\",\"format\":2,\"version\":\"9.9\"}"}})", "");
  newer.replace(detail::kChecksumBegin, 8, detail::checksum_of(newer.size(), reader_of(newer)));
  testing::write_content(path, newer);
  EXPECT_EQ(error_of(), "has format 2, written by sdnn 9.9; this is sdnn " + std::string(kVersion) +
                            ", which reads format 1");
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  EXPECT_EQ(error_of(), "is not a regular file");
#if SDNN_HAS_POSIX_FILES
  std::filesystem::remove(path);
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);  // without a writer, for which reading would wait
  EXPECT_EQ(error_of(), "is not a regular file");
#endif
}

TEST(Safetensors, InvalidFilesAreRefusedWithTheProblem) {
  const auto error_of = [](const std::string& file) {
    return testing::runtime_error_of([&] { (void)parsed(file); });
  };
  EXPECT_EQ(error_of(file_of(kHeader, kData)), "no error");
  const auto error_with = [&](const std::string& text, const std::string& replacement) {
    std::string header = kHeader;
    EXPECT_NE(header.find(text), std::string::npos) << text;
    return error_of(file_of(header.replace(header.find(text), text.size(), replacement), kData));
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
  EXPECT_EQ(error_with("\"b\"", "\"a\""), "its JSON has \"a\" twice");
  EXPECT_EQ(error_of(file_of(kHeader, kData + "x")),
            "has 1 bytes after its last tensor, or lost one");
  EXPECT_EQ(error_of(file_of(kHeader, kData.substr(1))),
            "tensor c reaches beyond the end of the file");
  EXPECT_EQ(error_with("F64", "F65"), "tensor b has a dtype that is not known");
  EXPECT_EQ(error_with("\"F64\"", "64"), "tensor b has a dtype that is not known");
  EXPECT_EQ(error_with("[0,8]", "[0,12]"), "tensor b is not as large as its shape");
  EXPECT_EQ(error_with("[0,8]", "[8,0]"), "tensor b reaches beyond the end of the file");
  EXPECT_EQ(error_with("[0,8]", "[0,18446744073709551615]"),
            "tensor b reaches beyond the end of the file");
  EXPECT_EQ(error_with("[0,8]", "[0,-8]"), "tensor b has no data_offsets of two numbers");
  EXPECT_EQ(error_with("[0,8]", "[0,8,9]"), "tensor b has no data_offsets of two numbers");
  EXPECT_EQ(error_with("[0,8]", "[4,12]"), "tensor b leaves a gap or overlaps another");
  EXPECT_EQ(error_with("[8,12]", "[0,4]"), "tensor b leaves a gap or overlaps another");
  EXPECT_EQ(error_with("[2,1]", "[2.0,1]"), "tensor a has no shape of numbers");
  EXPECT_EQ(error_with("[2,1]", "[2,3]"), "tensor a is not as large as its shape");
  EXPECT_EQ(error_with("[2,1]", "[0]"), "tensor a is not as large as its shape");
  EXPECT_EQ(error_with("[2,1]", "[4294967296,4294967296,4294967296,4]"),
            "tensor a is not as large as its shape");
  EXPECT_EQ(error_with("\"shape\":[1],", ""), "tensor b needs dtype, shape and data_offsets");
  EXPECT_EQ(error_with("{\"sdnn\":\"text\"}", "[]"), "has no text \"sdnn\" in its __metadata__");
  EXPECT_EQ(error_with("\"text\"", "3"), "has no text \"sdnn\" in its __metadata__");
}

// Any damaged file is either read or refused by std::runtime_error, and never by another error.
TEST(Safetensors, DamagedFilesAreReadOrRefusedWithARuntimeError) {
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
    n_refused += testing::runtime_error_of([&] { (void)parsed(bad); }) != "no error";
  }
  EXPECT_GT(n_refused, static_cast<int>(good.size()) + 1000);  // all cut, most changed files
}

}  // namespace
}  // namespace sdnn::core
