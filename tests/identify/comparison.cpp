#include "tests/identify/comparison.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tests/identify/rivals/rates.hpp"

namespace kilotwin::truth {
namespace {

constexpr double kHorizon_s = 10;

struct Method {
  const char* name;
  Rival (*fit)(const std::vector<RateRow>&, int robots);
};
constexpr std::array kMethods = {Method{"sparse regression", &sparse_regression},
                                 Method{"Gaussian process", &gaussian_process},
                                 Method{"neural network", &neural_network}};

/// Root mean square error over the rows of the oracle. Rows without a correction keep the base model's prediction.
double error_of(const std::vector<Prediction>& corrections,
                const std::map<std::tuple<std::string, int, long>, Vec>& before,
                const std::vector<Prediction>& oracle) {
  const auto key_of = [](const Prediction& p) {
    return std::tuple(std::to_string(p.run), p.robot, std::lround(1000 * p.time_s));
  };
  std::map<std::tuple<std::string, int, long>, Vec> corrected = before;
  for (const Prediction& p : corrections) {
    const auto at = corrected.find(key_of(p));
    if (at == corrected.end()) continue;
    at->second.x += p.predicted.x;
    at->second.y += p.predicted.y;
  }
  double sum = 0;
  int rows = 0;
  for (const Prediction& p : oracle) {
    const auto at = corrected.find(key_of(p));
    if (at == corrected.end()) continue;
    const double x = at->second.x - p.truth.x, y = at->second.y - p.truth.y;
    sum += x * x + y * y;
    ++rows;
  }
  return std::sqrt(sum / std::max(rows, 1));
}

/// Mean over the robots of the relative error of their speeds straight on.
double speed_error(const Eigen::VectorXd& straight_mm_s, const Scene& scene, const Play& play) {
  double sum = 0;
  for (std::size_t r = 0; r < play.individuals.size(); ++r) {
    const Wheels<double>& bias = play.individuals[r].bias_mm_s;
    const double truth = scene.straight_mm_s + (bias.left + bias.right) / 2;
    sum += std::abs(straight_mm_s[static_cast<Eigen::Index>(r)] / truth - 1);
  }
  return sum / static_cast<double>(play.individuals.size());
}

/// Speeds of the robots straight on, by identify.
Eigen::VectorXd identified_speeds(const std::filesystem::path& out, int robots) {
  std::ifstream in(out / "result.json");
  const nlohmann::json result = nlohmann::json::parse(in);
  Eigen::VectorXd speeds =
      Eigen::VectorXd::Constant(robots, result.at("base").at("straight_speed_mm_s").get<double>());
  for (const nlohmann::json& robot : result.at("robots"))
    speeds[robot.at("robot").get<Eigen::Index>()] +=
        (robot.at("bias_left_mm_s").get<double>() + robot.at("bias_right_mm_s").get<double>()) / 2;
  return speeds;
}

/// The causes of a rival. In its favour, an effect of several covariates counts as named if it has found each of them.
void judge_covariates(const Scene& scene, const Rival& rival, Verdict& verdict) {
  verdict.found = rival.covariates;
  for (const Effect& effect : scene.effects)
    names(effect, rival.covariates) ? void(++verdict.named) : verdict.unnamed.push_back(effect.name);
  for (const std::string& c : rival.covariates) {
    const bool related = std::any_of(scene.effects.begin(), scene.effects.end(),
                                     [&](const Effect& effect) { return touches(effect, {c}); });
    if (!related) verdict.false_findings.push_back(c);
  }
}

double per(double sum, int count) { return sum / std::max(count, 1); }

}  // namespace

Comparison::Comparison() {
  totals_.push_back({.method = "kilotwin identify", .names = true});
  for (const Method& method : kMethods) totals_.push_back({.method = method.name});
}

void Comparison::count(Total& total, const Verdict& v) {
  ++total.sets;
  total.log_ratio += std::log(v.after_mm / v.oracle_mm);
  total.log_improvement += std::log(v.before_mm / v.after_mm);
  total.seconds += v.seconds;
  total.causes += v.causes;
  total.named += v.named;
  total.wrong += static_cast<int>(v.false_findings.size());
  total.alarms += v.false_findings.empty() ? 0 : 1;
}

void Comparison::add(const Scene& scene, const Play& play, const std::vector<Prediction>& oracle,
                     const Verdict& identified, const std::filesystem::path& out) {
  if (!scene.heading || !identified.failure.empty()) {
    fmt::print("{:20} {}\n", scene.name, identified.failure.empty() ? "no headings" : identified.failure);
    return;
  }
  count(totals_[0], identified);
  const auto count_speeds = [&](Total& total, const Eigen::VectorXd& straight_mm_s) {
    if (!scene.effects.empty()) return;  // what its base speed refers to is a convention of each method
    total.speed_error += speed_error(straight_mm_s, scene, play);
    ++total.speed_sets;
  };
  count_speeds(totals_[0], identified_speeds(out, scene.robots));
  const auto before = base_predictions(out);
  std::string row =
      fmt::format("{:20} {:8.2f} {:8.2f} | {:8.2f} {:>5} {:5}", scene.name, identified.before_mm,
                  identified.oracle_mm, identified.after_mm,
                  fmt::format("{}/{}", identified.named, identified.causes), identified.false_findings.size());
  const std::vector<RateRow> rows = rate_rows(play.train);
  const Rival base = base_alone(rows, scene.robots);
  for (std::size_t m = 0; m < kMethods.size(); ++m) {
    const auto start = std::chrono::steady_clock::now();
    const Rival rival = kMethods[m].fit(rows, scene.robots);
    std::vector<Prediction> learned;
    for (const Run& run : play.test) {
      const std::vector<Prediction> of_run = corrections(rival, base, play.train, run, kHorizon_s);
      learned.insert(learned.end(), of_run.begin(), of_run.end());
    }
    count_speeds(totals_[m + 1], rival.straight_mm_s);
    Verdict v;
    v.before_mm = identified.before_mm;
    v.oracle_mm = identified.oracle_mm;
    v.after_mm = error_of(learned, before, oracle);
    v.causes = identified.causes;
    v.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    row += fmt::format(" | {:8.2f}", v.after_mm);
    totals_[m + 1].names = rival.names;
    if (rival.names) {
      judge_covariates(scene, rival, v);
      row += fmt::format(" {:>5} {:5}", fmt::format("{}/{}", v.named, v.causes), v.false_findings.size());
    }
    count(totals_[m + 1], v);
  }
  fmt::print("{}\n", row);
  std::fflush(stdout);
}

void Comparison::print_header() const {
  fmt::print("{:20} {:>8} {:>8} | {:>8} {:>5} {:>5} | {:>8} {:>5} {:>5} | {:>8} | {:>8}\n", "scene", "base",
             "oracle", "identify", "named", "false", "sparse", "named", "false", "gauss", "neural");
}

void Comparison::print_summary() const {
  for (const Total& t : totals_) {
    const double precision = per(t.named, t.named + t.wrong), recall = per(t.named, t.causes);
    fmt::print("{}: {} sets, error over the oracle's {:.3f}, base error over its own {:.2f}", t.method, t.sets,
               std::exp(per(t.log_ratio, t.sets)), std::exp(per(t.log_improvement, t.sets)));
    if (t.names)
      fmt::print(", precision {:.2f}, recall {:.2f}, F1 {:.2f}, a false cause in {} sets", precision, recall,
                 precision + recall > 0 ? 2 * precision * recall / (precision + recall) : 0, t.alarms);
    if (t.speed_sets > 0)
      fmt::print(", speeds {:.1f} % off without an effect", 100 * per(t.speed_error, t.speed_sets));
    fmt::print(", {:.1f} s a set\n", per(t.seconds, t.sets));
  }
}

}  // namespace kilotwin::truth
