// The report renders any result.
#include "clients/identify/report/report.hpp"

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <libxml/HTMLparser.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>

#include "clients/identify/report/report_plots.hpp"
#include "clients/report/gnuplot.hpp"
#include "clients/report/html.hpp"
#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

using nlohmann::json;

json full_document() {
  json document = json::parse(R"({
    "result": {
      "before": {"rmse_mm": 16.31, "rmse_low_mm": 14.9, "rmse_high_mm": 17.7, "rows": 736},
      "after": {"rmse_mm": 3.52, "rmse_low_mm": 3.3, "rmse_high_mm": 3.75, "rows": 736},
      "noise_floor_mm": 3.38, "noise_floor_how": "from the innovations", "horizon_s": 10,
      "effects": [
        {"name": "battery", "covariates": ["time"], "acts_on": "WHEEL_GAIN", "parameters": {"form": "spline"},
         "evidence": {"log10_p": -212, "p_family": 1e-200, "log_likelihood_gain": 2311, "held_out_gain": 811, "held_out_gain_se": 40},
         "rmse_without_mm": 14.7, "share_removed": 0.83, "in_words": "Wheels run slower the later it is."},
        {"name": "lens", "covariates": ["measurement"], "acts_on": "MEASURED_SCALE", "evidence": {"log10_p": -9},
         "parameters": {"form": "spline"}, "rmse_without_mm": 5.1, "share_removed": 0.1}],
      "rejected": [{"name": "grain", "covariates": ["heading"], "acts_on": "WHEEL_GAIN", "log10_p": -2.9, "threshold_log10_p": -5}],
      "ambiguous": [{"found": "time", "instead": "motor_time", "log_likelihood_difference": 3.1, "experiment": "Let some rest."}],
      "faults": [{"kind": "swapped", "run": "1", "robot": 3, "in_words": "Robots 3 and 9 carry each other's number."}],
      "robots": [{"robot": 0, "before_mm": 15, "after_mm": 3, "bias_left_mm_s": -0.8, "sd_left_mm_s": 0.1, "noise_ratio": 1.9,
                  "noise_ratio_low": 1.5, "noise_ratio_high": 2.3}, {"robot": 1, "before_mm": 17, "after_mm": 4}],
      "base": {"straight_speed_mm_s": 9.98, "wheel_base_mm": 25}, "noise": {"factor_variance_s": 0.0014},
      "noise_low": {"factor_variance_s": 0.0012}, "noise_high": {"factor_variance_s": 0.0017}, "base_sd": {"wheel_base_mm": 0.5}},
    "set": {"runs": 3, "robots": 16, "has_headings": true},
    "steps": [{"added": "base model", "rmse_mm": 16.3}, {"added": "battery", "rmse_mm": 5.9}, {"added": "lens", "rmse_mm": 3.5}],
    "msd": {"lag_s": [1, 10, 100], "measured_mm2": [90, 6000, 60000], "simulated_mm2": [91, 6100, 59000]},
    "distributions": [{"name": "speed", "unit": "mm/s", "edges": [0, 5, 10, 15], "measured": [3, 20, 4], "simulated": [2, 21, 5]}],
    "covariate_plots": [{"target": "forward", "covariate": "time", "unit": "s", "acts_on_unit": "mm/s", "at": [10, 100, 190],
      "before": [0, -2, -4], "before_se": [0.1, 0.1, 0.1], "after": [0, 0.1, 0]}],
    "horizon": {"at_s": [1, 5, 10], "before_mm": [2, 8, 16], "after_mm": [0.5, 2, 3.5], "floor_mm": [0.5, 1.9, 3.4]},
    "maps": [
      {"target": "forward", "unit": "mm/s", "x_mm": [-10, 0, 10], "y_mm": [-10, 10], "before": [[1, 2, null], [0, 1, 2]], "after": [[0, 0, null], [0, 0, 0]]},
      {"target": "world_x", "unit": "mm/s", "x_mm": [-10, 0, 10], "y_mm": [-10, 10], "before": [[1, 2, 1], [0, 1, 2]], "after": [[0, 0, 0], [0, 0, 0]]},
      {"target": "world_y", "unit": "mm/s", "x_mm": [-10, 0, 10], "y_mm": [-10, 10], "before": [[1, 2, 1], [0, 1, 2]], "after": [[0, 0, 0], [0, 0, 0]]}]
  })");
  return document;
}

/// Nothing if the schema refuses the document.
std::optional<identification::Identification> result_of(const json& document) {
  identification::Identification result;
  const auto status = google::protobuf::util::JsonStringToMessage(document.dump(), &result);
  if (!status.ok()) return std::nullopt;
  return result;
}
std::string page_of(const json& document) { return report_html(result_of(document).value()); }

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

/// Whether the XML parser accepts it, apart from unknown HTML 5 elements.
bool parses(const std::string& page) {
  htmlParserCtxtPtr context = htmlNewParserCtxt();
  const htmlDocPtr tree =
      htmlCtxtReadMemory(context, page.data(), static_cast<int>(page.size()), nullptr, "utf-8",
                         HTML_PARSE_NOERROR | HTML_PARSE_NOWARNING | HTML_PARSE_NONET | XML_PARSE_HUGE);
  constexpr int kUnknownElement = 801;
  const xmlError* const last = xmlCtxtGetLastError(context);
  const bool good = tree != nullptr && (last == nullptr || last->code == kUnknownElement);
  if (last != nullptr && !good) ADD_FAILURE() << last->line << ": " << last->message;
  xmlFreeDoc(tree);
  htmlFreeParserCtxt(context);
  return good;
}

TEST(Report, ShowsTheDocument) {
  const std::string page = page_of(full_document());
  EXPECT_TRUE(parses(page));
  for (const char* said :
       {"depends on <em>time</em>", "the measurement", "16.3 mm", "3.52 mm", "3.38 mm",
        "Wheels run slower the later it is.", "10⁻²⁰⁰", "Robots 3 and 9 carry each other", "Let some rest.",
        "grain", "id=\"maps\"", "id=\"simulated\"", "wheel base, mm", "83 %"}) {
    EXPECT_NE(page.find(said), std::string::npos) << said;
  }
  // Plots: one card, horizon, steps, robots, two maps and two arrow maps, one covariate, one distribution, MSD.
  EXPECT_EQ(count(page, "<img "), 11U);
  EXPECT_EQ(count(page, "<plot "), 0U);
}

TEST(Report, StatesIntervals) {
  const std::string page = page_of(full_document());
  for (const char* said : {"0.00140 (0.00120 to 0.00170)", "25.0 ± 0.980", "-0.800 ± 0.196", "1.90 (1.50 to 2.30)"})
    EXPECT_NE(page.find(said), std::string::npos) << said;
}

/// Number of drawn shapes of a colour.
std::size_t shapes(const Gnuplot& plots, const std::string& colour) {
  return count(plots.draw().at(0).svg, "rgb(" + colour + ")");
}

TEST(Report, DrawsTheBandOfACurve) {
  identification::EffectCurve curve;
  for (const double at : {0.0, 1.0, 2.0}) {
    curve.add_at(at);
    curve.add_value(at);
  }
  const std::string band = "201, 216, 234";
  Gnuplot without, with;
  ASSERT_TRUE(plot_effect(without, curve));
  EXPECT_EQ(shapes(without, band), 0U);
  for (const double at : {0.0, 1.0, 2.0}) {
    curve.add_low(at - 1);
    curve.add_high(at + 1);
  }
  ASSERT_TRUE(plot_effect(with, curve));
  EXPECT_GT(shapes(with, band), 0U);
}

TEST(Report, MarksWhereTheBandOfAMapHoldsZero) {
  // The interval of the first of three columns holds zero.
  identification::EffectMap map;
  for (const double at : {0.0, 10.0, 20.0}) {
    map.add_x_mm(at);
    map.add_y_mm(at);
    auto &effect = *map.add_effect(), &low = *map.add_low(), &high = *map.add_high();
    for (const double value : {1.0, 5.0, 9.0}) {
      effect.add_values()->set_number_value(value);
      low.add_values()->set_number_value(value - 2);
      high.add_values()->set_number_value(value + 2);
    }
  }
  const std::string marks = " 90, 102, 115";
  Gnuplot with, without;
  ASSERT_TRUE(plot_effect_map(with, map));
  EXPECT_GT(shapes(with, marks), 0U);
  for (auto& row : *map.mutable_low()) row.mutable_values(0)->set_number_value(0.5);
  ASSERT_TRUE(plot_effect_map(without, map));
  EXPECT_EQ(shapes(without, marks), 0U);
}

TEST(Report, IsSelfContained) {
  const std::string page = page_of(full_document());
  EXPECT_EQ(count(page, "src="), count(page, "src=\"data:image/svg+xml;base64,"));
  EXPECT_EQ(count(page, "<script"), 0U);
  EXPECT_EQ(count(page, "<link"), 0U);
  EXPECT_EQ(count(page, "http"), 0U);
}

TEST(Report, SaysThatThereIsNoEffect) {
  json document = full_document();
  document["result"]["effects"] = json::array();
  const std::string page = page_of(document);
  EXPECT_NE(page.find("No tested effect improves on the base model"), std::string::npos);
  EXPECT_EQ(page.find("id=\"why\""), std::string::npos);
}

TEST(Report, SaysThatOnlyTheMeasurementHasEffects) {
  json document = full_document();
  document["result"]["effects"].erase(0);
  EXPECT_NE(page_of(document).find("The base model explains the motion, but"), std::string::npos);
}

TEST(Report, EscapesMarkupAndCommands) {
  json document = full_document();
  const std::filesystem::path trap =
      std::filesystem::path(testing::TempDir()) / ("report-trap-" + std::to_string(getpid()));
  std::filesystem::remove(trap);
  const std::string evil =
      "<script>x</script>'\nsystem 'touch " + trap.string() + "'\n\"`touch " + trap.string() + "`_{x}^";
  for (const char* key : {"name", "in_words"}) document["result"]["effects"][0][key] = evil;
  document["result"]["effects"][0]["covariates"] = json::array({"time", evil});
  document["steps"][1]["added"] = evil;
  document["covariate_plots"][0]["target"] = evil;
  document["covariate_plots"][0]["unit"] = evil;
  document["distributions"][0]["name"] = evil;
  document["maps"][0]["unit"] = evil;
  document["set"]["held_out"] = evil;
  const std::string page = page_of(document);
  EXPECT_TRUE(parses(page));
  EXPECT_EQ(count(page, "<script"), 0U);
  EXPECT_FALSE(std::filesystem::exists(trap));
}

TEST(Report, AnEmptyResultGivesAPage) { EXPECT_TRUE(parses(report_html({}))); }

/// Replaces a random entry by another value.
void mutate(json& value, std::mt19937& dice) {
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(dice() % n); };
  if (value.is_structured() && !value.empty() && pick(8) != 0) {
    auto at = value.begin();
    std::advance(at, static_cast<std::ptrdiff_t>(pick(value.size())));
    if (pick(12) == 0) {
      value.erase(at);
    } else {
      mutate(*at, dice);
    }
    return;
  }
  const json others[] = {nullptr,
                         true,
                         -1,
                         0,
                         1e300,
                         -1e-300,
                         "text",
                         json::array(),
                         json::object(),
                         json::array({nullptr, 1, "x"}),
                         json{{"rmse_mm", 1}}};
  value = others[pick(std::size(others))];
}

TEST(Report, AnyResultGivesAPage) {
  std::mt19937 dice(7);
  int tries = 0;
  for (int pages = 0; pages < 15;) {
    ASSERT_LT(++tries, 3000) << "the schema refuses what mutations make";
    json document = full_document();
    for (int k = 0; k < 1 + pages / 3; ++k) mutate(document, dice);
    const auto result = result_of(document);
    if (!result) continue;
    ++pages;
    EXPECT_NO_THROW({ EXPECT_TRUE(parses(report_html(*result))) << document.dump(); }) << document.dump();
  }
}

TEST(Gnuplot, AFailedPlotLeavesTheOthers) {
  Gnuplot plots;
  plots.add(100, 100, "plot x");
  plots.add(100, 100, "plot nonsense(");
  plots.add(100, 100, "plot sin(x)");
  const auto drawn = plots.draw();
  ASSERT_EQ(drawn.size(), 3U);
  EXPECT_NE(drawn[0].svg.find("<svg"), std::string::npos);
  EXPECT_EQ(drawn[0].error, "");
  EXPECT_EQ(drawn[1].svg, "");
  EXPECT_NE(drawn[1].error, "");
  EXPECT_NE(drawn[2].svg.find("<svg"), std::string::npos);
}

}  // namespace
}  // namespace kilotwin::identify
