// Prints what was measured beside what was expected, and ends with status 1 where anything misses.
// Usage: validate [--quick] [--plots DIR] [--results FILE.md] [NAME]...
#include <fmt/format.h>

#include <fstream>
#include <string>
#include <vector>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "tests/validation/validations.hpp"

namespace {

using namespace kilotwin;
using namespace kilotwin::validation;

struct Validation {
  const char* name;
  void (*run)(Runs&, Verdicts&, Effort);
};

constexpr Validation kValidations[] = {{"bias", validate_bias},
                                       {"straight", validate_straight},
                                       {"diffusion", validate_diffusion},
                                       {"box", validate_box},
                                       {"packing", validate_packing}};

int usage() {
  std::string names;
  for (const Validation& v : kValidations) names += fmt::format(" {}", v.name);
  say("usage: validate [--quick] [--plots DIR] [--results FILE.md] [NAME]...; names:" + names);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  Effort effort;
  std::vector<std::string> wanted;
  std::string results;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick") {
      effort.quick = true;
      continue;
    }
    if (word == "--plots" && i + 1 < argc) {
      effort.plots = argv[++i];
      continue;
    }
    if (word == "--results" && i + 1 < argc) {
      results = argv[++i];
      continue;
    }
    bool known = false;
    for (const Validation& v : kValidations) known = known || word == v.name;
    if (!known) return usage();
    wanted.push_back(word);
  }
  try {
    Runs runs(KILOTWIN_PROGRAM, KILOTWIN_SOURCES);
    Verdicts verdicts;
    for (const Validation& v : kValidations) {
      bool chosen = wanted.empty();
      for (const std::string& name : wanted) chosen = chosen || name == v.name;
      if (chosen) v.run(runs, verdicts, effort);
    }
    const std::string end =
        fmt::format("\n{} of {} figures as expected\n", verdicts.rows() - verdicts.misses(), verdicts.rows());
    fmt::print("{}", end);
    if (!results.empty()) std::ofstream{results} << verdicts.markdown() << end;
    return verdicts.misses() == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    say(fmt::format("validate: {}", error.what()));
    return 1;
  }
}
