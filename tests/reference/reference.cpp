// Makes the generated regions of docs/reference anew. scripts/reference builds and calls it.
// Usage: reference [--check]
#include <fmt/format.h>

#include <cstring>
#include <exception>
#include <fstream>

#include "core/base/say.hpp"
#include "tests/reference/pages.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin;
  const bool check = argc == 2 && std::strcmp(argv[1], "--check") == 0;
  if (argc > 1 && !check) {
    say("usage: reference [--check]; it rewrites the generated regions of docs/reference, or names pages that "
        "differ");
    return 2;
  }
  try {
    const std::filesystem::path sources = KILOTWIN_SOURCE_DIR;
    const reference::Regions regions = reference::regions(sources, KILOTWIN_PROGRAM);
    int differing = 0;
    for (const char* name : reference::kPages) {
      const std::filesystem::path page = sources / "docs" / "reference" / name;
      const std::string before = reference::read_text(page), after = reference::regenerated(before, regions);
      if (before == after) continue;
      ++differing;
      fmt::print("{} {}\n", page.string(), check ? "differs; run scripts/reference" : "written");
      if (!check) std::ofstream{page} << after;
    }
    return check && differing > 0 ? 1 : 0;
  } catch (const std::exception& error) {
    say(fmt::format("reference: {}", error.what()));
    return 1;
  }
}
