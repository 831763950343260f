/// A temporary directory of a test, with the files that its experiments name.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "core/experiment/layout.hpp"
#include "core/experiment/load.hpp"
#include "core/experiment/validate.hpp"

namespace kilotwin::test {

class Scratch : public ::testing::Test {
 protected:
  Scratch() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    dir_ = std::filesystem::temp_directory_path() /
           (std::string{"kilotwin-experiment-"} + info->name() + "-" + std::to_string(getpid()));
    std::filesystem::create_directories(dir_);
    write("a.c", "int main(void) { return 0; }\n");
  }
  ~Scratch() override { std::filesystem::remove_all(dir_); }

  std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::ofstream{dir_ / name, std::ios::binary} << content;
    return dir_ / name;
  }
  LoadedExperiment load(const std::string& text) const { return load_experiment(write("e.txtpb", text)); }

  /// The error that `action` throws, without the directory; "" if it succeeds.
  template <class Action> std::string error_of(Action action) const {
    try {
      action();
      return "";
    } catch (const UserError& error) {
      std::string line = error.what();
      const std::string prefix = dir_.string() + "/";
      for (std::size_t at; (at = line.find(prefix)) != std::string::npos;) line.erase(at, prefix.size());
      return line;
    }
  }
  std::string load_error(const std::string& text) const {
    return error_of([&] { static_cast<void>(load(text)); });
  }
  std::string check_error(const std::string& text) const {
    return error_of([&] { validate(load(text)); });
  }

  std::filesystem::path dir_;
};

}  // namespace kilotwin::test
