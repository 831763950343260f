#include "tests/identify/verdict.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "core/stats/quantiles.hpp"

namespace kilotwin::truth {
namespace {

using nlohmann::json;

struct Row {
  Vec before, after;
};
using Key = std::tuple<std::string, int, long>;  // run, robot, time in ms

std::map<Key, Row> read_rows(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  const std::string header = "run,robot,time_s,before_x_mm,before_y_mm,after_x_mm,after_y_mm";
  if (!std::getline(in, line) || line != header) throw std::runtime_error("predictions.csv lacks its header");
  std::map<Key, Row> rows;
  while (std::getline(in, line)) {
    std::vector<std::string> cells;
    std::stringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    if (cells.size() != 7) throw std::runtime_error("predictions.csv: " + line);
    const Key key{cells[0], std::stoi(cells[1]), std::lround(std::stod(cells[2]) * 1000)};
    rows[key] = {{std::stod(cells[3]), std::stod(cells[4])}, {std::stod(cells[5]), std::stod(cells[6])}};
  }
  return rows;
}

bool holds(const Covariates& all, const std::string& one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

double square_distance(Vec a, Vec b) { return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y); }

const char* word(Fault::Kind kind) {
  constexpr std::array kWords = {"swapped", "clock", "duplicate", "outliers", "frozen"};
  return kWords[static_cast<std::size_t>(kind)];
}

/// Whether a found fault matches: kind, run, and an affected robot if there is one.
bool is(const Fault& fault, const json& found) {
  if (found.value("kind", "") != word(fault.kind)) return false;
  const json run = found.value("run", json());
  if ((run.is_string() ? run.get<std::string>() : run.dump()) != std::to_string(fault.run)) return false;
  if (fault.kind == Fault::Kind::kClock || fault.kind == Fault::Kind::kOutliers) return true;
  const json robot = found.value("robot", json());
  return robot == fault.robot ||
         ((fault.kind == Fault::Kind::kSwapped || fault.kind == Fault::Kind::kDuplicate) && robot == fault.other);
}

void judge_errors(const std::vector<Prediction>& oracle, const std::filesystem::path& file, Verdict& verdict) {
  const std::map<Key, Row> rows = read_rows(file);
  std::array<double, 6> sum{};
  std::vector<double> later_after_mm, later_oracle_mm;
  for (const Prediction& p : oracle) {
    const auto row = rows.find({std::to_string(p.run), p.robot, std::lround(p.time_s * 1000)});
    if (row == rows.end()) {
      ++verdict.missing_rows;
      continue;
    }
    const std::array<double, 3> errors = {square_distance(row->second.before, p.truth),
                                          square_distance(row->second.after, p.truth),
                                          square_distance(p.predicted, p.truth)};
    ++verdict.rows;
    if (p.time_s >= 20) {
      later_after_mm.push_back(std::sqrt(errors[1]));
      later_oracle_mm.push_back(std::sqrt(errors[2]));
    }
    for (std::size_t k = 0; k < 3; ++k) {
      sum[k] += errors[k];
      if (p.time_s >= 20) sum[k + 3] += errors[k];
    }
  }
  const auto later = static_cast<int>(later_after_mm.size());
  if (later > 0) {
    verdict.median_after_mm = stats::nearest_quantile(later_after_mm, 0.5);
    verdict.median_oracle_mm = stats::nearest_quantile(later_oracle_mm, 0.5);
  }
  const auto rms = [](double total, int count) { return std::sqrt(total / std::max(count, 1)); };
  verdict.before_mm = rms(sum[0], verdict.rows);
  verdict.after_mm = rms(sum[1], verdict.rows);
  verdict.oracle_mm = rms(sum[2], verdict.rows);
  verdict.later_before_mm = rms(sum[3], later);
  verdict.later_after_mm = rms(sum[4], later);
  verdict.later_oracle_mm = rms(sum[5], later);
}

void judge_causes(const Scene& scene, const json& result, Verdict& verdict) {
  std::vector<bool> named(scene.effects.size());
  for (const json& found : result.at("effects")) {
    const auto covariates = found.at("covariates").get<Covariates>();
    const std::string text = fmt::format("{} [{}]", found.value("name", "?"), fmt::join(covariates, " "));
    verdict.found.push_back(text);
    bool related = false;
    for (std::size_t k = 0; k < scene.effects.size(); ++k) {
      if (names(scene.effects[k], covariates)) named[k] = true;
      related = related || touches(scene.effects[k], covariates);
    }
    if (!related) verdict.false_findings.push_back(text);
  }
  const json left = result.value("unexplained", json::object());
  if (left.value("large", false)) verdict.unexplained = left.at("in_words");
  verdict.perhaps = left.value("perhaps", false);
  std::vector<bool> caught(scene.faults.size());
  for (const json& found : result.value("faults", json::array())) {
    bool real = false;
    for (std::size_t k = 0; k < scene.faults.size(); ++k) {
      if (!is(scene.faults[k], found)) continue;
      caught[k] = real = true;
    }
    const std::string text = fmt::format("{} in run {}, robot {}", found.value("kind", "?"),
                                         found.value("run", json()).dump(), found.value("robot", json()).dump());
    verdict.found.push_back(text);
    if (!real) verdict.false_findings.push_back(text);
  }
  verdict.causes = static_cast<int>(scene.effects.size() + scene.faults.size());
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (scene.effects[k].by_chance && scene.effects[k].named_by.empty())
      --verdict.causes;
    else if (named[k])
      ++verdict.named;
    else
      verdict.unnamed.push_back(scene.effects[k].name);
  }
  for (std::size_t k = 0; k < caught.size(); ++k) {
    if (caught[k])
      ++verdict.named;
    else
      verdict.unnamed.push_back(fmt::format("{} in run {}", word(scene.faults[k].kind), scene.faults[k].run));
  }
}

}  // namespace

bool names(const Effect& effect, const Covariates& covariates) {
  return std::any_of(effect.named_by.begin(), effect.named_by.end(), [&](const Covariates& set) {
    return std::all_of(set.begin(), set.end(), [&](const std::string& c) { return holds(covariates, c); });
  });
}

bool touches(const Effect& effect, const Covariates& covariates) {
  bool any = false;
  for (const std::string& c : covariates) {
    if (holds(effect.mistaken_for, c)) return false;
    for (const Covariates& set : effect.named_by) any = any || holds(set, c);
  }
  return any;
}

double Verdict::ratio() const { return std::max(after_mm / oracle_mm, later_after_mm / later_oracle_mm); }

bool Verdict::good() const {
  return failure.empty() && missing_rows == 0 && ratio() <= kRatio && unnamed.empty() && false_findings.empty();
}

std::map<Key, Vec> base_predictions(const std::filesystem::path& out) {
  std::map<Key, Vec> before;
  for (const auto& [key, row] : read_rows(out / "predictions.csv")) before[key] = row.before;
  return before;
}

Verdict judge(const Scene& scene, const std::vector<Prediction>& oracle, const std::filesystem::path& out) {
  Verdict verdict;
  verdict.scene = scene.name;
  try {
    judge_errors(oracle, out / "predictions.csv", verdict);
    std::ifstream in(out / "result.json");
    judge_causes(scene, json::parse(in), verdict);
  } catch (const std::exception& error) {
    verdict.failure = error.what();
  }
  return verdict;
}

}  // namespace kilotwin::truth
