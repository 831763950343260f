#include "core/os/checksummed_file.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <random>

#include "core/base/error.hpp"

namespace kilotwin {
namespace {

constexpr FileKind kKind{"KTWNTEST", 7, "a test's file", "write it again"};

/// A directory in memory if possible, because these tests write thousands of files.
std::filesystem::path memory() {
  return ::access("/dev/shm", W_OK) == 0 ? std::filesystem::path("/dev/shm")
                                         : std::filesystem::temp_directory_path();
}

class ChecksummedFile : public testing::Test {
 protected:
  ChecksummedFile() {
    std::string pattern = (memory() / "kilotwin-checksummed-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ~ChecksummedFile() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_ / "file"; }
  [[nodiscard]] std::string bytes() const {
    std::ifstream in(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void put(const std::string& bytes) const { std::ofstream(file(), std::ios::binary | std::ios::trunc) << bytes; }
  /// The error of reading the file; empty if there is none.
  [[nodiscard]] std::string complaint(const FileKind& kind = kKind) const {
    try {
      static_cast<void>(read_checksummed(file(), kind));
    } catch (const UserError& error) {
      return error.what();
    }
    return {};
  }
  std::filesystem::path folder_;
};

std::string random_bytes(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes += static_cast<char>(random());
  return bytes;
}

TEST_F(ChecksummedFile, ReturnsTheWrittenContent) {
  for (const std::size_t length : {0u, 1u, 8191u, 8192u, 8193u, 16384u, 100'000u}) {
    const std::string content = random_bytes(length, length);
    write_checksummed(file(), kKind, content);
    EXPECT_EQ(read_checksummed(file(), kKind), content) << length;
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator()), 1);
}

TEST_F(ChecksummedFile, DetectsEveryFlippedBit) {
  write_checksummed(file(), kKind, random_bytes(600, 1));
  const std::string right = bytes();
  for (std::size_t bit = 0; bit < 8 * right.size(); ++bit) {
    std::string wrong = right;
    wrong[bit / 8] = static_cast<char>(wrong[bit / 8] ^ 1 << bit % 8);
    put(wrong);
    const std::string complaint = this->complaint();
    ASSERT_NE(complaint, "") << "bit " << bit;
    EXPECT_EQ(complaint.find(file().string() + ": "), 0u) << complaint;
    EXPECT_NE(complaint.find("octet"), std::string::npos) << complaint;
  }
}

TEST_F(ChecksummedFile, DetectsRandomChangesAndNamesTheBlock) {
  write_checksummed(file(), kKind, random_bytes(50'000, 2));
  const std::string right = bytes();
  std::mt19937_64 random(3);
  for (int round = 0; round < 300; ++round) {
    std::string wrong = right;
    const std::size_t first = 28 + random() % (right.size() - 28);
    wrong[first] = static_cast<char>(wrong[first] ^ static_cast<int>(1 + random() % 255));
    for (std::uint64_t more = random() % 5; more > 0; --more) {
      const std::size_t at = first + random() % (right.size() - first);
      if (at != first) wrong[at] = static_cast<char>(random());
    }
    put(wrong);
    const std::size_t block = 28 + (first - 28) / 8196 * 8196;
    EXPECT_NE(complaint().find(" from octet " + std::to_string(block) + " on; write it again"), std::string::npos)
        << complaint();
  }
}

TEST_F(ChecksummedFile, DetectsTruncationAndAppendedOctets) {
  write_checksummed(file(), kKind, random_bytes(300, 4));
  const std::string right = bytes();
  for (std::size_t length = 0; length < right.size(); ++length) {
    put(right.substr(0, length));
    EXPECT_NE(complaint(), "") << length;
  }
  put(right + '\0');
  EXPECT_NE(complaint().find("goes on after its end"), std::string::npos) << complaint();
}

TEST_F(ChecksummedFile, DetectsExchangedBlocks) {
  write_checksummed(file(), kKind, random_bytes(2 * 8192, 5));
  const std::string right = bytes();
  put(right.substr(0, 28) + right.substr(28 + 8196) + right.substr(28, 8196));
  EXPECT_NE(complaint().find("from octet 28 on"), std::string::npos) << complaint();
}

TEST_F(ChecksummedFile, RefusesOtherKindsAndFormats) {
  write_checksummed(file(), kKind, "content");
  EXPECT_NE(
      complaint({"KTWNELSE", 7, "something else", "write it again"}).find("is not something else in format 7"),
      std::string::npos);
  EXPECT_NE(
      complaint({"KTWNTEST", 8, "a test's file", "write it again"}).find("is of format 7; this program reads"),
      std::string::npos);
  put("");
  EXPECT_NE(complaint().find("is empty"), std::string::npos);
  std::filesystem::remove(file());
  EXPECT_NE(complaint().find("cannot be read: No such file"), std::string::npos) << complaint();
}

TEST_F(ChecksummedFile, ReportsAFileThatCannotBeWritten) {
  EXPECT_THROW(write_checksummed(folder_ / "none/file", kKind, "content"), RunError);
}

}  // namespace
}  // namespace kilotwin
