// The committed pages of docs/reference against what their sources say today.
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

#include "core/experiment/text_file.hpp"
#include "idl/experiment.pb.h"
#include "tests/reference/pages.hpp"

namespace kilotwin::reference {
namespace {

const std::filesystem::path kSources = KILOTWIN_SOURCE_DIR;

class Page : public testing::TestWithParam<const char*> {};

TEST_P(Page, AgreesWithItsSources) {
  const std::string page = read_text(kSources / "docs" / "reference" / GetParam());
  EXPECT_EQ(page, regenerated(page, regions(kSources, KILOTWIN_PROGRAM)))
      << "docs/reference/" << GetParam() << " is out of date: run scripts/reference and commit the page";
}

std::string name_of(const testing::TestParamInfo<const char*>& page) {
  std::string name = std::filesystem::path{page.param}.stem().string();
  std::replace(name.begin(), name.end(), '-', '_');  // names of tests are identifiers
  return name;
}
INSTANTIATE_TEST_SUITE_P(Reference, Page, testing::ValuesIn(kPages), name_of);

TEST(ReferencePages, ARegionIsMadeAnewAndTheRestIsKept) {
  const Regions one{{"x", [] { return std::string{"new\n"}; }}};
  EXPECT_EQ(regenerated("a\n<!-- generated: x -->\nold\n<!-- end of x -->\nb\n", one),
            "a\n<!-- generated: x -->\nnew\n<!-- end of x -->\nb\n");
  EXPECT_EQ(regenerated("nothing generated\n", one), "nothing generated\n");
  EXPECT_THROW((void)regenerated("<!-- generated: x -->\n", one), std::runtime_error);
  EXPECT_THROW((void)regenerated("<!-- generated: y -->\n<!-- end of y -->\n", one), std::runtime_error);
}

/// Every field of every message that an experiment can hold has a row on one of the two pages.
TEST(ReferencePages, SchemaPagesHaveARowForEveryField) {
  const std::string pages =
      read_text(kSources / "docs/reference/experiment.md") + read_text(kSources / "docs/reference/model.md");
  std::vector<const google::protobuf::Descriptor*> found{proto::Experiment::descriptor()};
  std::set<const google::protobuf::Descriptor*> seen{found.front()};
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::size_t section = pages.find("\n### " + found[i]->name() + "\n");
    ASSERT_NE(section, std::string::npos) << found[i]->name();
    const std::string text = pages.substr(section, pages.find("\n### ", section + 1) - section);
    for (int f = 0; f < found[i]->field_count(); ++f) {
      EXPECT_NE(text.find("| `" + found[i]->field(f)->name() + "` |"), std::string::npos)
          << found[i]->field(f)->full_name();
      const google::protobuf::Descriptor* below = found[i]->field(f)->message_type();
      if (below != nullptr && seen.insert(below).second) found.push_back(below);
    }
  }
  EXPECT_GT(found.size(), 30u);
}

/// Every key of result.json says what it holds, unless its name does.
TEST(ReferencePages, KeysOfResultsHaveMeanings) {
  static const std::set<std::string> named = {"name", "unit", "run",  "in_words",
                                              "area", "low",  "high", "parameters"};
  std::istringstream page{read_text(kSources / "docs/reference/result-keys.md")};
  static const std::regex row{"\\| `([a-z0-9_]+)` \\|.*\\| ([^|]*)\\|"};
  std::size_t rows = 0;
  std::string section;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("### ")) section = line.substr(4);
    std::smatch found;
    if (section.starts_with("Radio") || section == "PopulationClass" || !std::regex_match(line, found, row))
      continue;
    ++rows;
    const std::string meaning = found[2];
    EXPECT_TRUE(named.contains(found[1]) || meaning.find_first_not_of(' ') != std::string::npos)
        << section << "." << found[1] << ": comment it in idl/identification.proto";
  }
  EXPECT_GT(rows, 150U);
}

/// Whether a path of a page leads somewhere: "core/os" and "core/os/files.hpp" exist, "core/os/files.*" has some ending.
bool exists(const std::string& path) {
  namespace fs = std::filesystem;
  if (!path.ends_with(".*")) return fs::exists(kSources / path);
  const fs::path stem = kSources / path.substr(0, path.size() - 2);
  if (!fs::exists(stem.parent_path())) return false;
  for (const fs::directory_entry& entry : fs::directory_iterator(stem.parent_path()))
    if (entry.path().stem() == stem.filename()) return true;
  return false;
}

/// Pages name files as `core/os/files.hpp`; such a file must be there.
TEST(Pages, EveryPathInACodeSpanExists) {
  static const std::regex span{
      "`((?:core|services|clients|idl|tests|docs|scripts|bench|experiments|behaviours|deploy|cmake)/"
      "[A-Za-z0-9_./-]*(?:[.][*])?)`"};
  std::vector<std::filesystem::path> pages{kSources / "ARCHITECTURE.md"};
  for (const char* folder : {"docs/explanation", "docs/reference", "docs/results"})
    for (const auto& entry : std::filesystem::directory_iterator(kSources / folder))
      if (entry.path().extension() == ".md") pages.push_back(entry.path());
  std::size_t checked = 0;
  for (const std::filesystem::path& page : pages) {
    const std::string text = read_text(page);
    for (std::sregex_iterator at{text.begin(), text.end(), span}, end; at != end; ++at, ++checked)
      EXPECT_TRUE(exists((*at)[1])) << page.filename() << " names " << (*at)[1];
  }
  EXPECT_GT(checked, 100u);
}

/// The examples of a page are indented blocks; those under "## Examples" are whole experiments.
TEST(ReferencePages, ExamplesOfExperimentsAreReadable) {
  std::ifstream in{kSources / "docs/reference/experiment.md"};
  std::string line, block;
  bool examples = false;
  int blocks = 0;
  const auto parse = [&] {
    if (block.empty()) return;
    proto::Experiment experiment;
    SourceLocations locations{"docs"};
    EXPECT_NO_THROW(parse_text("docs", block, experiment, locations)) << block;
    EXPECT_GT(experiment.robots_size(), 0) << block;
    block.clear();
    ++blocks;
  };
  while (std::getline(in, line)) {
    examples = examples ? !line.starts_with("## ") : line == "## Examples";
    if (examples && line.starts_with("    ")) {
      block += line + "\n";
    } else {
      parse();
    }
  }
  parse();
  EXPECT_GE(blocks, 2);
}

}  // namespace
}  // namespace kilotwin::reference
