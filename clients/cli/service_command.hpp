/// `kilotwin service`: one service in the foreground.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin::cli {

struct ServiceArguments {
  std::string service;        ///< physics, comm, station, behaviours
  std::filesystem::path run;  ///< a directory that `run --prepare` wrote
  std::string partition;      ///< physics: "C,R"
  std::string share;          ///< behaviours: "I/N"
  std::uint32_t domain = 0;
  std::vector<std::string> peers;
  double start_monotonic_s = 0;  ///< when the command was given, steady clock; for start_s
};

/// Returns the exit status. Throws UserError and RunError.
int service_command(const ServiceArguments& arguments);

}  // namespace kilotwin::cli
