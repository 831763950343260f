// Runs the demonstrations of docs/explanation/gallery.md and measures each. Ends with status 1 where a measure misses.
// Usage: gallery [--pictures DIR] [--results FILE.md] [NAME]...
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "tests/validation/gallery/demos.hpp"

namespace {

using namespace kilotwin;
using namespace kilotwin::validation;
namespace fs = std::filesystem;

struct Demo {
  const char* name;
  void (*show)(const DemoSettings&, Verdicts&);
};

constexpr Demo kDemos[] = {{"speaker-listener", show_speaker_listener},
                           {"orbit", show_orbit},
                           {"edge-follow", show_edge_follow},
                           {"disperse", show_disperse},
                           {"phototaxis", show_phototaxis},
                           {"gradient", show_gradient},
                           {"sync", show_sync},
                           {"firefly", show_firefly},
                           {"leader-election", show_leader_election},
                           {"morphogenesis", show_morphogenesis},
                           {"follow", show_follow}};

int usage() {
  std::string names;
  for (const Demo& demo : kDemos) names += fmt::format(" {}", demo.name);
  say("usage: gallery [--pictures DIR] [--results FILE.md] [NAME]...; names:" + names);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  DemoSettings settings;
  std::vector<std::string> wanted;
  std::string results;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto known = [&](const Demo& demo) { return word == demo.name; };
    if (word == "--pictures" && i + 1 < argc)
      settings.pictures = argv[++i];
    else if (word == "--results" && i + 1 < argc)
      results = argv[++i];
    else if (std::any_of(std::begin(kDemos), std::end(kDemos), known))
      wanted.push_back(word);
    else
      return usage();
  }
  settings.kilotwin = KILOTWIN_PROGRAM;
  settings.folder = fs::path(KILOTWIN_SOURCES) / "experiments/gallery";
  std::string scratch = (fs::temp_directory_path() / "kilotwin-gallery-XXXXXX").string();
  try {
    if (mkdtemp(scratch.data()) == nullptr) throw RunError("no scratch directory can be made");
    settings.scratch = scratch;
    Verdicts verdicts;
    for (const Demo& demo : kDemos) {
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), demo.name) == wanted.end()) continue;
      verdicts.section(demo.name);
      demo.show(settings, verdicts);
    }
    fs::remove_all(scratch);
    const std::string end =
        fmt::format("\n{} of {} measures as expected\n", verdicts.rows() - verdicts.misses(), verdicts.rows());
    fmt::print("{}", end);
    if (!results.empty()) std::ofstream{results} << verdicts.markdown() << end;
    return verdicts.misses() == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    say(fmt::format("gallery: {}", error.what()));
    std::error_code ignored;
    fs::remove_all(scratch, ignored);
    return 1;
  }
}
