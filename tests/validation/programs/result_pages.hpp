/// Results of compare_programs as pages.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/validation/programs/outcome.hpp"
#include "tests/validation/programs/pair.hpp"

namespace kilotwin::validation {

/// Seeds of a program with a measure that differs by more than 10 % with one seed; of one that the test then tells apart.
inline constexpr int kMoreSeeds = static_cast<int>(kLeastRuns), kMostSeeds = 3 * kMoreSeeds;

/// Causes for which programs differ or do not run: a table with the columns `of` ("difference" or "refusal"), `program` and `cause`.
class Causes {
 public:
  /// Throws UserError if the file is no such table.
  explicit Causes(const std::filesystem::path& file);
  /// The cause of a program's difference or refusal, or "". `program`: its path below the folder that is compared.
  [[nodiscard]] std::string of(const std::string& what, const std::string& program) const;

 private:
  struct Cause {
    std::string of, program, text;
  };
  std::vector<Cause> causes_;
};

/// One program.
struct Row {
  std::string name, verdict, detail, changes, note;
  std::string cause;  ///< of Causes; why it differs or does not run
  int seeds = 0;
  bool ran = false, agrees = false;
  bool known = false;  ///< it does not agree, for a known cause
};

/// One line.
[[nodiscard]] std::string totals(const std::vector<Row>& rows);
/// docs/results/programs.md, below its head.
[[nodiscard]] std::string own_page(const std::vector<Row>& rows, const PairSettings& settings);
/// docs/results/public-programs.md, below its head. The names begin with OWNER/NAME of a repository.
[[nodiscard]] std::string public_page(const std::vector<Row>& rows, const PairSettings& settings);

}  // namespace kilotwin::validation
