#include "clients/identify/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "clients/identify/report_html.hpp"
#include "clients/identify/report_plots.hpp"
#include "clients/recorder/file.hpp"

namespace kilotwin::identify {
namespace {

using html::escaped;
using nlohmann::json;

const json kNothing;

const json& part(const json& from, const char* key) {
  if (!from.is_object()) return kNothing;
  const auto at = from.find(key);
  return at == from.end() ? kNothing : *at;
}

std::string text(const json& from, const char* key) {
  const json& value = part(from, key);
  return value.is_string() ? value.get<std::string>() : value.is_null() ? "" : value.dump();
}

std::optional<double> number(const json& from, const char* key) {
  const json& value = part(from, key);
  if (!value.is_number()) return std::nullopt;
  return value.get<double>();
}

/// Three digits.
std::string figure(std::optional<double> value) {
  if (!value || !std::isfinite(*value)) return "–";
  const double size = std::abs(*value);
  if (size == 0) return "0";
  if (size >= 1e5 || size < 1e-4) return fmt::format("{:.2e}", *value);
  const int digits = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 6);
  return fmt::format("{:.{}f}", *value, digits);
}

std::string percent(std::optional<double> share) { return share ? fmt::format("{:.0f} %", 100 * *share) : "–"; }

/// p as a power of ten.
std::string chance(std::optional<double> log10_p) {
  if (!log10_p) return "–";
  if (*log10_p > -2.5) return fmt::format("{:.2g}", std::pow(10, *log10_p));
  return fmt::format("10<sup>−{:.0f}</sup>", -*log10_p);
}

/// A cause as what "it depends on ..." goes on with.
std::string phrase_of(const std::string& covariate) {
  static const std::map<std::string, std::string> kPhrases = {{"time", "how late it is in the run"},
                                                              {"position", "where they are"},
                                                              {"heading", "where they point to"},
                                                              {"command", "what they are told"},
                                                              {"time_since_command", "how long ago they were told"},
                                                              {"motor_time", "how long each motor has run"},
                                                              {"neighbours", "who is near by"},
                                                              {"world_frame", "a direction in the room"},
                                                              {"measurement", "the tracker"},
                                                              {"robot", "which robot it is"},
                                                              {"history", "what was before"}};
  const auto at = kPhrases.find(covariate);
  return at == kPhrases.end() ? words_of(covariate) : at->second;
}

std::string covariates_of(const json& effect) {
  std::string out;
  for (const json& covariate : part(effect, "covariates")) {
    if (covariate.is_string()) out += (out.empty() ? "" : " and ") + phrase_of(covariate.get<std::string>());
  }
  return out.empty() ? "nothing: it is the same everywhere" : out;
}

bool is_measurement(const json& effect) {
  if (text(effect, "acts_on").starts_with("MEASURED")) return true;
  const json& covariates = part(effect, "covariates");
  return std::any_of(covariates.begin(), covariates.end(), [](const json& c) { return c == "measurement"; });
}

std::string acts_on_of(const json& effect) {
  static const std::map<std::string, std::string> kWords = {
      {"WHEEL_GAIN", "wheel speeds, in proportion"},
      {"WHEEL_OFFSET", "wheel speeds"},
      {"TURN_RATE", "turning"},
      {"BODY_DRIFT", "slip of the body"},
      {"WORLD_DRIFT", "drift in the room"},
      {"MEASURED_OFFSET", "what the tracker sees"},
      {"MEASURED_BODY_OFFSET", "the point that the tracker sees"},
      {"MEASURED_SCALE", "what the tracker sees, in proportion"},
      {"MEASURED_HEADING", "headings that the tracker sees"}};
  const std::string name = text(effect, "acts_on");
  const auto at = kWords.find(name);
  return at == kWords.end() ? escaped(words_of(name)) : at->second;
}

/// Plots in the order of the page; the page is put together before they are drawn.
class Figures {
 public:
  explicit Figures(Gnuplot& plots) : plots_(plots) {}
  Gnuplot& plots() { return plots_; }

  /// Where the plot will stand; empty where there is none.
  std::string place(PlotNumber number, const std::string& caption, const char* kind = "") {
    if (!number) return "";
    return fmt::format("<figure{}>{}{}</figure>\n", *kind == 0 ? "" : fmt::format(" class=\"{}\"", kind),
                       mark(*number, caption),
                       caption.empty() ? "" : "<figcaption>" + escaped(caption) + "</figcaption>");
  }
  std::string pair(PlotNumber before, PlotNumber after, const std::string& caption) {
    if (!before && !after) return "";
    std::string out = "<figure class=\"pair\">";
    if (before) out += mark(*before, caption + ", before");
    if (after) out += mark(*after, caption + ", after");
    return out + "<figcaption>" + escaped(caption) + "</figcaption></figure>\n";
  }
  /// The page with all plots in it.
  std::string filled(std::string page) const {
    const std::vector<Gnuplot::Drawn> drawn = plots_.draw();
    for (const auto& [number, alt] : alts_) {
      const std::string here = html::mark_of(number);
      const std::string shown = drawn[number].error.empty() ? html::image(drawn[number].svg, alt)
                                                            : "<p>This plot could not be drawn.</p>";
      page.replace(page.find(here), here.size(), shown);
    }
    return page;
  }

 private:
  std::string mark(std::size_t number, const std::string& alt) {
    alts_.emplace(number, alt);
    return html::mark_of(number);
  }

  Gnuplot& plots_;
  std::map<std::size_t, std::string> alts_;
};

std::string section(const char* id, const char* title, const std::string& lead, const std::string& body) {
  if (body.empty()) return "";
  return fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}{}</section>\n", id, title,
                     lead.empty() ? "" : "<p class=\"lead\">" + lead + "</p>\n", body);
}

struct Errors {
  std::optional<double> before, after, floor;
};

Errors errors_of(const json& contract) {
  return {number(part(contract, "before"), "rmse_mm"), number(part(contract, "after"), "rmse_mm"),
          number(contract, "noise_floor_mm")};
}

/// How much of what a model can take away at all was taken away: errors add as squares.
std::optional<double> share_explained(const Errors& e) {
  if (!e.before || !e.after || !e.floor) return std::nullopt;
  const double could = *e.before * *e.before - *e.floor * *e.floor;
  if (could <= 0) return std::nullopt;
  return std::clamp((*e.before * *e.before - *e.after * *e.after) / could, 0.0, 1.0);
}

std::string headline(const json& contract) {
  std::vector<std::string> causes;
  bool tracker = false;
  for (const json& effect : part(contract, "effects")) {
    if (is_measurement(effect)) {
      tracker = true;
      continue;
    }
    const std::string cause = "<em>" + escaped(covariates_of(effect)) + "</em>";
    if (std::find(causes.begin(), causes.end(), cause) == causes.end()) causes.push_back(cause);
  }
  const char* const kSeen = "<em>the tracker</em> does not see them where they are";
  if (causes.empty() && !tracker) return "The base model explains these robots";
  if (causes.empty()) return fmt::format("These robots do what the base model says, but {}", kSeen);
  std::string because = causes[0];
  if (causes.size() == 2) because += ", and on " + causes[1];
  if (causes.size() > 2) because += ", on " + causes[1] + " and more";
  return fmt::format("These robots differ from the base model: what they do depends on {}{}", because,
                     tracker ? fmt::format("; and {}", kSeen) : "");
}

std::string verdict(const json& contract) {
  const Errors e = errors_of(contract);
  const std::string ahead = fmt::format("{:g}", number(contract, "horizon_s").value_or(10));
  std::string out = fmt::format(
      "Predicted {} s ahead, on data that nothing was fitted to, robots were <b>{} mm</b> away from where the base "
      "model had them",
      ahead, figure(e.before));
  const std::size_t count = part(contract, "effects").is_array() ? part(contract, "effects").size() : 0;
  if (count == 0) {
    out += ". No effect of anything that was tried is beyond chance.";
  } else {
    out += fmt::format("; with {} in the model, <b>{} mm</b>.",
                       count == 1 ? "one effect" : fmt::format("{} effects", count), figure(e.after));
  }
  if (e.floor && e.after && *e.after <= *e.floor) {
    out += fmt::format(
        " That is as good as any model can be expected to be with these robots and this tracker (about <b>{} "
        "mm</b>).",
        figure(e.floor));
  } else if (e.floor) {
    out += fmt::format(" The best that any model can do with these robots and this tracker is about <b>{} mm</b>.",
                       figure(e.floor));
  }
  const json& faults = part(contract, "faults");
  if (const auto share = share_explained(e); share && count > 0)
    out += fmt::format(" {} of what could be explained is explained.", percent(share));
  if (faults.is_array() && !faults.empty()) {
    out += fmt::format(" The data have <a href=\"#faults\">{}</a>, which {} excluded.",
                       faults.size() == 1 ? "a fault" : fmt::format("{} faults", faults.size()),
                       faults.size() == 1 ? "was" : "were");
  }
  return out;
}

/// The errors as bars, with their confidence intervals.
std::string bars(const json& contract) {
  const Errors e = errors_of(contract);
  if (!e.before || !e.after) return "";
  const double most = std::max(
      {*e.before, *e.after, e.floor.value_or(0), number(part(contract, "before"), "rmse_high_mm").value_or(0)});
  if (most <= 0) return "";
  const auto bar = [&](const char* kind, const char* name, double value, const json& from) {
    const auto low = number(from, "rmse_low_mm"), high = number(from, "rmse_high_mm");
    const std::string interval =
        low && high ? fmt::format("<small>{} to {} (95 %)</small>", figure(low), figure(high)) : "";
    return fmt::format(
        "<div class=\"bar\"><span class=\"what\">{}</span><span class=\"track\"><span class=\"fill {}\" "
        "style=\"width:{:.1f}%\"></span></span>"
        "<span class=\"value\"><b>{} mm</b> {}</span></div>\n",
        name, kind, 100 * value / most, figure(value), interval);
  };
  std::string out = "<div class=\"bars\">\n" + bar("before", "before", *e.before, part(contract, "before")) +
                    bar("after", "after", *e.after, part(contract, "after"));
  if (e.floor) out += bar("floor", "floor", *e.floor, kNothing);
  return out + "</div>\n";
}

/// Bars of any measure, as the document gives them: as long as they are above `from`.
std::string given_bars(const json& bars) {
  double most = 0;
  for (const json& bar : bars) {
    const double from = number(bar, "from").value_or(0);
    most = std::max({most, number(bar, "value").value_or(0) - from, number(bar, "high").value_or(0) - from});
  }
  if (most <= 0) return "";
  std::string out;
  for (const json& bar : bars) {
    const auto low = number(bar, "low"), high = number(bar, "high");
    const double above = number(bar, "value").value_or(0) - number(bar, "from").value_or(0);
    out += fmt::format(
        "<div class=\"bar\"><span class=\"what\">{}</span><span class=\"track\"><span class=\"fill {}\" "
        "style=\"width:{:.1f}%\"></span></span><span class=\"value\"><b>{} {}</b> {}</span></div>\n",
        escaped(text(bar, "name")), escaped(text(bar, "kind")), std::max(100 * above / most, 0.0),
        figure(number(bar, "value")), escaped(text(bar, "unit")),
        low && high ? fmt::format("<small>{} to {} (95 %)</small>", figure(low), figure(high)) : "");
  }
  return "<div class=\"bars\">\n" + out + "</div>\n";
}

bool shares_covariate(const json& effect, const std::string& covariate) {
  static const std::map<std::string, std::set<std::string>> kOf = {
      {"position", {"x", "y", "radius", "position"}},
      {"motor_time", {"motor_time", "driven_time", "left_motor_time", "right_motor_time"}},
      {"neighbours", {"neighbours", "nearest", "density", "nearest_bearing", "bearing"}},
      {"history", {"previous_command", "last_turn", "place", "history"}}};
  for (const json& c : part(effect, "covariates")) {
    const std::string name = c.is_string() ? c.get<std::string>() : "";
    const auto of = kOf.find(name);
    if (name == covariate || (of != kOf.end() && of->second.contains(covariate))) return true;
  }
  return false;
}

/// The plot in which an effect shows best: over its covariate, with the effect drawn in, the strongest against its errors.
const json* plot_for(const json& effect, const json& plots) {
  const json* best = nullptr;
  double best_strength = 0;
  for (const json& plot : plots) {
    if (!shares_covariate(effect, text(plot, "covariate"))) continue;
    const bool fitted = part(plot, "fitted").is_array();
    double strength = fitted ? 1e6 : 1e-6;
    const json &before = part(plot, "before"), &se = part(plot, "before_se");
    for (std::size_t k = 0; before.is_array() && se.is_array() && k < std::min(before.size(), se.size()); ++k) {
      if (!before[k].is_number() || !se[k].is_number() || !(se[k].get<double>() > 0)) continue;
      const double z = before[k].get<double>() / se[k].get<double>();
      strength += z * z;
    }
    if (strength <= best_strength) continue;
    best = &plot;
    best_strength = strength;
  }
  return best;
}

std::string cards(const json& contract, const json& covariate_plots, Figures& figures) {
  std::string out;
  std::set<const json*> shown;
  for (const json& effect : part(contract, "effects")) {
    const json& evidence = part(effect, "evidence");
    std::string words = text(effect, "in_words");
    if (words.empty()) words = fmt::format("{} depends on {}.", acts_on_of(effect), covariates_of(effect));
    out += "<article class=\"cause\"><div>";
    out += fmt::format("<h3>{}</h3><p>{}</p>", escaped(covariates_of(effect)), escaped(words));
    out += "<dl>";
    const auto fact = [&](const char* name, const std::string& value) {
      out += fmt::format("<dt>{}</dt><dd>{}</dd>", name, value);
    };
    fact("acts on", acts_on_of(effect));
    if (const json& facts = part(effect, "facts"); facts.is_array()) {
      for (const json& given : facts)
        out += fmt::format("<dt>{}</dt><dd>{}</dd>", escaped(given.at(0).get<std::string>()),
                           escaped(given.at(1).get<std::string>()));
    } else {
      fact("takes away", percent(number(effect, "share_removed")) + " of the squared error");
      fact("without it", "the error is " + figure(number(effect, "rmse_without_mm")) + " mm");
      fact("by chance",
           chance(number(evidence, "p_family") ? std::log10(std::max(*number(evidence, "p_family"), 1e-300))
                                               : number(evidence, "log10_p")));
    }
    out += "</dl></div>";
    const json* plot = covariate_plots.is_array() ? plot_for(effect, covariate_plots) : nullptr;
    if (plot != nullptr && shown.insert(plot).second)
      out += figures.place(plot_covariate(figures.plots(), *plot), "");
    out += "</article>\n";
  }
  return out;
}

std::string maps(const json& all, Figures& figures) {
  if (!all.is_array()) return "";
  std::string out;
  std::set<std::string> done;
  const auto find = [&](const std::string& target) -> const json* {
    for (const json& map : all) {
      if (text(map, "target") == target) return &map;
    }
    return nullptr;
  };
  for (const json& map : all) {
    const std::string target = text(map, "target");
    if (!done.insert(target).second) continue;
    if (target.size() > 2 && (target.ends_with("_x") || target.ends_with("_y"))) {
      const std::string stem = target.substr(0, target.size() - 2);
      const json *x = find(stem + "_x"), *y = find(stem + "_y");
      if (x != nullptr && y != nullptr) {
        done.insert(stem + "_x");
        done.insert(stem + "_y");
        out += figures.pair(plot_arrows(figures.plots(), *x, *y, "before"),
                            plot_arrows(figures.plots(), *x, *y, "after"),
                            fmt::format("What is left in the {}, over the arena", words_of(stem)));
        continue;
      }
    }
    out += figures.pair(plot_map(figures.plots(), map, "before"), plot_map(figures.plots(), map, "after"),
                        fmt::format("What is left in the {}, over the arena", words_of(target)));
  }
  return out;
}

std::string effects_table(const json& contract) {
  const json& effects = part(contract, "effects");
  if (!effects.is_array() || effects.empty()) return "";
  html::Table table({"effect", "depends on", "acts on", "form", "by chance", "gain in log-likelihood",
                     "on data held out", "error without it, mm", "share"});
  for (const json& effect : effects) {
    const json& evidence = part(effect, "evidence");
    const auto held = number(evidence, "held_out_gain"), se = number(evidence, "held_out_gain_se");
    const auto family = number(evidence, "p_family");
    table.row({escaped(text(effect, "name")), escaped(covariates_of(effect)), acts_on_of(effect),
               escaped(text(part(effect, "parameters"), "form")),
               chance(family ? std::log10(std::max(*family, 1e-300)) : number(evidence, "log10_p")),
               figure(number(evidence, "log_likelihood_gain")),
               held ? figure(held) + (se ? " ± " + figure(se) : "") : "–",
               figure(number(effect, "rmse_without_mm")), percent(number(effect, "share_removed"))});
  }
  return table.text();
}

std::string rejected_table(const json& contract) {
  const json& rejected = part(contract, "rejected");
  if (!rejected.is_array() || rejected.empty()) return "";
  const bool reasons =
      std::any_of(rejected.begin(), rejected.end(), [](const json& tried) { return !text(tried, "why").empty(); });
  std::vector<std::string> heads = {"tried", "depends on", "acts on", "chance of as much", "needed"};
  if (reasons) heads.emplace_back("why not");
  html::Table table(std::move(heads));
  for (const json& tried : rejected) {
    std::vector<std::string> cells = {escaped(text(tried, "name")), escaped(covariates_of(tried)),
                                      acts_on_of(tried), chance(number(tried, "log10_p")),
                                      chance(number(tried, "threshold_log10_p"))};
    if (reasons) cells.push_back(escaped(text(tried, "why")));
    table.row(cells);
  }
  return table.text();
}

/// Tables that the document brings along, each a section of its own.
std::string given_tables(const json& tables) {
  std::string out;
  for (const json& given : tables) {
    std::vector<std::string> heads;
    for (const json& head : part(given, "head")) heads.push_back(escaped(head.get<std::string>()));
    html::Table table(std::move(heads));
    for (const json& row : part(given, "rows")) {
      std::vector<std::string> cells;
      for (const json& cell : row) cells.push_back(escaped(cell.get<std::string>()));
      table.row(cells);
    }
    out += section(text(given, "id").c_str(), escaped(text(given, "title")).c_str(), escaped(text(given, "lead")),
                   table.text());
  }
  return out;
}

std::string ambiguous_list(const json& contract) {
  std::string out;
  for (const json& pair : part(contract, "ambiguous")) {
    out += fmt::format(
        "<li>Found: <b>{}</b>. <b>{}</b> would explain the data about as well (log-likelihood {} lower). {}</li>\n",
        escaped(text(pair, "found")), escaped(text(pair, "instead")),
        figure(number(pair, "log_likelihood_difference")), escaped(text(pair, "experiment")));
  }
  return out.empty() ? "" : "<ul>" + out + "</ul>\n";
}

std::string fault_list(const json& contract) {
  std::string out;
  for (const json& fault : part(contract, "faults")) {
    out += fmt::format("<li><b>{}</b> {}</li>\n", escaped(text(fault, "kind")), escaped(text(fault, "in_words")));
  }
  return out.empty() ? "" : "<ul class=\"faults\">" + out + "</ul>\n";
}

/// Keys and figures of an object, as a table in two columns.
std::string figures_of(const json& object) {
  if (!object.is_object() || object.empty()) return "";
  html::Table table({"", ""});
  for (const auto& [key, value] : object.items()) {
    std::string shown = value.is_number_integer() ? value.dump()
                        : value.is_number()       ? figure(value.get<double>())
                                                  : "";
    if (value.is_string()) shown = escaped(value.get<std::string>());
    if (value.is_boolean()) shown = value.get<bool>() ? "yes" : "no";
    if (!shown.empty()) table.row({escaped(html::with_unit(key)), shown});
  }
  return table.text("facts");
}

}  // namespace

std::string report_html(const json& document) {
  const json& contract = part(document, "contract");
  const json& plots = part(document, "covariate_plots");
  Gnuplot gnuplot;
  Figures figures(gnuplot);
  std::string page = fmt::format(
      "<header><p class=\"kicker\">Kilotwin · identified from measured data</p><h1>{}</h1>\n<p "
      "class=\"verdict\">{}</p>\n{}</header>\n",
      text(document, "headline").empty() ? headline(contract) : escaped(text(document, "headline")),
      text(document, "verdict").empty() ? verdict(contract) : escaped(text(document, "verdict")),
      part(document, "bars").is_array() ? given_bars(part(document, "bars")) : bars(contract));
  page += section("why", "Why", "", cards(contract, plots, figures));
  const std::size_t effects = part(contract, "effects").is_array() ? part(contract, "effects").size() : 0;
  const Errors errors = errors_of(contract);
  std::string better = figures.place(plot_horizon(gnuplot, part(document, "horizon")),
                                     "Error over how far ahead robots are predicted");
  if (effects > 0) {
    better += figures.place(plot_steps(gnuplot, part(document, "steps"), errors.floor.value_or(std::nan(""))),
                            "Error as the model grew, one effect at a time; dashed: the floor");
  }
  if (!better.empty()) better = "<div class=\"grid\">" + better + "</div>\n";
  better += figures.place(plot_robots(gnuplot, part(document, "robots")), "Each robot's error, largest first");
  page += section(
      "better", "By how much it is better",
      escaped(text(contract, "noise_floor_how").empty() ? ""
                                                        : "The floor: " + text(contract, "noise_floor_how") + "."),
      better);
  page += given_tables(part(document, "tables"));
  page +=
      section("faults", "Faults of the data",
              "Excluded before anything was fitted. They are slips of the measurement, and no property of robots.",
              fault_list(contract));
  page +=
      section("maps", "Where",
              "Residuals over the arena, before and after, in the same colours. A good model leaves no pattern.",
              maps(part(document, "maps"), figures));
  std::string traced;
  if (plots.is_array()) {
    for (const json& plot : plots) traced += figures.place(plot_covariate(gnuplot, plot), "");
  }
  page += section(
      "traced", "What residuals depend on",
      "Means of what the model leaves, with two standard errors. A good model leaves none beside the line at 0.",
      traced.empty() ? "" : "<div class=\"grid\">" + traced + "</div>");
  page += section("table", "The effects and their evidence", "", effects_table(contract));
  std::string second;
  for (const json& distribution : part(document, "distributions"))
    second += figures.place(plot_distribution(gnuplot, distribution), "");
  second += figures.place(plot_msd(gnuplot, part(document, "msd")), "");
  page +=
      section("simulated", "Simulated beside measured",
              "A second, independent check: the model written here, run in the simulator under the same commands.",
              second.empty() ? "" : "<div class=\"grid\">" + second + "</div>");
  page += section("ambiguous", "What these data cannot tell apart", "", ambiguous_list(contract));
  page += section("rejected", "Tried and rejected",
                  "The strongest of what was tried and is not beyond chance, many trials allowed for.",
                  rejected_table(contract));
  std::string model;
  for (const auto& [key, title] : {std::pair{"base", "Drive"}, {"noise", "Noise"}}) {
    const std::string table = figures_of(part(contract, key));
    if (!table.empty()) model += fmt::format("<div><h3>{}</h3>{}</div>\n", title, table);
  }
  if (const std::string table = figures_of(part(document, "set")); !table.empty())
    model += "<div><h3>Data</h3>" + table + "</div>\n";
  page += section("model", "The base model and the data", "",
                  model.empty() ? "" : "<div class=\"thirds\">" + model + "</div>");
  return html::page("Kilotwin: what these robots' motion depends on", figures.filled(std::move(page)));
}

void write_report(const json& document, const std::filesystem::path& file) {
  recorder::write_file(file, report_html(document));
}

}  // namespace kilotwin::identify
