#include "tests/validation/programs/result_pages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "core/csv/csv_reader.hpp"

namespace kilotwin::validation {
namespace {

std::string settings_text(const PairSettings& settings) {
  return fmt::format(
      "\n{} robots, {} s, the default `loop_rate`, no noise of motion. A program runs with seed 1. If a measure\n"
      "differs by more than 10 %, it runs with seeds 1 to {}. If the test then tells both kinds apart, it runs "
      "with\n"
      "seeds 1 to {}, and the test is made again.\n\n"
      "| verdict | meaning |\n|---|---|\n"
      "| event for event | every change of motors and LED comes within one tick, and the counts of messages are "
      "equal "
      "|\n"
      "| alike | the means of path, distance, LED and messages differ by at most 10 % |\n"
      "| not distinguishable | a measure differs by more than 10 %, and a permutation test over runs gives p >= "
      "{:.4f} "
      "|\n"
      "| differs | a measure differs by more than 10 %, and the test gives p < {:.4f} |\n\n",
      settings.robots, settings.duration_s, kMoreSeeds, kMostSeeds, kLevel, kLevel);
}

/// Text as a cell of a table.
std::string cell(std::string text) {
  std::erase_if(text, [](char c) { return c == '|' || c == '\n'; });
  constexpr std::size_t kLongest = 160;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return text;
}

/// OWNER/NAME, or the whole name if it has no such beginning.
std::string repository_of(const std::string& name) {
  const std::size_t owner = name.find('/');
  const std::size_t end = owner == std::string::npos ? owner : name.find('/', owner + 1);
  return name.substr(0, end);
}

/// Numbers of programs by verdict.
struct Counts {
  std::size_t event = 0, alike = 0, same = 0, differ = 0, refused = 0;
  void add(const Row& row) {
    ++(!row.ran                               ? refused
       : row.verdict == "event for event"     ? event
       : row.verdict == "alike"               ? alike
       : row.verdict == "not distinguishable" ? same
                                              : differ);
  }
  [[nodiscard]] std::string line(const std::string& name) const {
    return fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", name, event + alike + same + differ, event, alike,
                       same, differ, refused);
  }
};

}  // namespace

Causes::Causes(const std::filesystem::path& file) {
  CsvReader reader(file);
  reader.require({"of", "program", "cause"}, "a table of causes");
  while (reader.next())
    causes_.push_back({std::string(reader.text(reader.column("of"))),
                       std::string(reader.text(reader.column("program"))),
                       std::string(reader.text(reader.column("cause")))});
}

std::string Causes::of(const std::string& what, const std::string& program) const {
  const auto found = std::find_if(causes_.begin(), causes_.end(),
                                  [&](const Cause& one) { return one.of == what && one.program == program; });
  return found == causes_.end() ? "" : found->text;
}

std::string totals(const std::vector<Row>& rows) {
  const auto count = [&](bool Row::*what) {
    return std::count_if(rows.begin(), rows.end(), [what](const Row& row) { return row.*what; });
  };
  const auto open =
      std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.verdict == "not distinguishable"; });
  const auto ran = count(&Row::ran), agree = count(&Row::agrees) - open;
  return fmt::format(
      "Of {} programs that run both ways, {} agree, {} are not distinguishable, and {} differ; {} do not run\n",
      ran, agree, open, ran - agree - open, static_cast<std::ptrdiff_t>(rows.size()) - ran);
}

std::string own_page(const std::vector<Row>& rows, const PairSettings& settings) {
  std::string page =
      settings_text(settings) +
      "| program | verdict | seeds | changes alike, of native, of firmware | largest difference: native, "
      "firmware |\n|---|---|---|---|---|\n";
  for (const Row& row : rows)
    page +=
        fmt::format("| `{}` | {} | {} | {} | {} |\n", row.name, row.verdict, row.seeds, row.changes, row.detail);
  return page + "\n" + totals(rows);
}

std::string public_page(const std::vector<Row>& rows, const PairSettings& settings) {
  std::map<std::string, Counts> repositories;
  Counts all;
  for (const Row& row : rows) {
    repositories[repository_of(row.name)].add(row);
    all.add(row);
  }
  std::string page =
      "\nPrograms of public repositories, each run natively and as firmware. DIR holds the repositories as "
      "`OWNER/NAME`.\nNo program of them is part of Kilotwin. Of programs that differ in white space alone, one is "
      "counted.\n" +
      settings_text(settings) +
      "| repository | run both ways | event for event | alike | not distinguishable | differ | do not run |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const auto& [name, counts] : repositories) page += counts.line(name);
  page += all.line("all");
  page +=
      "\n## Programs that are not alike\n\n| program | verdict | clearest difference: native, firmware | cause |\n"
      "|---|---|---|---|\n";
  for (const Row& row : rows) {
    if (row.ran && row.verdict != "alike" && row.verdict != "event for event")
      page += fmt::format("| `{}` | {} | {} | {} |\n", row.name, row.verdict, row.detail,
                          row.cause.empty() ? "not known" : row.cause);
  }
  page += "\n## Programs that do not run\n\n| program | message | cause |\n|---|---|---|\n";
  for (const Row& row : rows) {
    if (!row.ran) page += fmt::format("| `{}` | {} | {} |\n", row.name, cell(row.note), row.cause);
  }
  return page + "\n" + totals(rows);
}

}  // namespace kilotwin::validation
