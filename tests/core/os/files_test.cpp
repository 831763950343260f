// Whole files: errors give the reason, and replacing a file is atomic.
#include "core/os/files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin::os {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  Files() {
    std::string name = (fs::temp_directory_path() / "kilotwin-files-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  ~Files() override { fs::remove_all(folder_); }
  fs::path folder_;
};

template <class Error, class Action> std::string error_of(Action action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST_F(Files, ReturnTheWrittenContent) {
  const std::string content("a\0b\n\xff", 5);
  write_file(folder_ / "a", content);
  EXPECT_EQ(read_file(folder_ / "a"), content);
  EXPECT_EQ(read_if_there(folder_ / "a"), content);
  write_file(folder_ / "a", "shorter");
  EXPECT_EQ(read_file(folder_ / "a"), "shorter");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "no draft is left";
}

TEST_F(Files, ReportWhyTheyCannotBeRead) {
  const std::string name = (folder_ / "none").string();
  EXPECT_EQ(error_of<UserError>([&] { (void)read_file(name); }),
            name + ": cannot be read: No such file or directory");
  EXPECT_EQ(error_of<UserError>([&] { (void)read_file(folder_); }),
            folder_.string() + ": cannot be read: Is a directory");
  EXPECT_EQ(read_if_there(name), std::nullopt);
  EXPECT_EQ(read_if_there(folder_), std::nullopt);
}

TEST_F(Files, ReportWhyTheyCannotBeWritten) {
  EXPECT_NE(error_of<RunError>([&] { write_file(folder_ / "no" / "file", "x"); }).find("No such file or directory"),
            std::string::npos);
  EXPECT_EQ(error_of<RunError>([] { write_file("/dev/full", "x"); }),
            "/dev/full: cannot be written: No space left on device");
}

TEST_F(Files, AreRefusedReplacedOrAppendedTo) {
  const fs::path file = folder_ / "log";
  using Existing = OutputFile::Existing;
  const auto add = [&](Existing existing, const char* text) {
    OutputFile output(file, existing);
    output.buffer() += text;
    output.close();
  };
  add(Existing::kRefuse, "one");
  add(Existing::kAppend, "two");
  EXPECT_EQ(read_file(file), "onetwo");
  add(Existing::kReplace, "three");
  EXPECT_EQ(read_file(file), "three");
  EXPECT_NE(error_of<RunError>([&] { add(Existing::kRefuse, "x"); }).find("File exists"), std::string::npos);
}

}  // namespace
}  // namespace kilotwin::os
