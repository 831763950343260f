#include "clients/cli/sweep_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "clients/cli/text_table.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/summary.hpp"
#include "clients/report/html.hpp"
#include "clients/report/templates.hpp"
#include "core/base/error.hpp"
#include "core/csv/csv_writer.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace {

using recorder::kObservables;
using stats::Moments;

/// Two CSV columns, mean and standard error; both empty without a value.
std::string csv_pair(const Moments& sample) {
  if (sample.count() == 0) return ",,";
  return fmt::format(",{:.10g},{:.4g}", sample.mean(), sample.standard_error());
}

std::string csv_number(double value) { return std::isfinite(value) ? fmt::format(",{:.10g}", value) : ","; }

std::string html_table(const std::vector<std::vector<std::string>>& rows) {
  const auto escaped = [](const std::vector<std::string>& row) {
    std::vector<std::string> cells;
    cells.reserve(row.size());
    for (const std::string& cell : row) cells.push_back(html::escaped(cell));
    return cells;
  };
  html::Table table(escaped(rows[0]));
  for (std::size_t i = 1; i < rows.size(); ++i) table.row(escaped(rows[i]));
  return table.text();
}

}  // namespace

SweepReport::SweepReport(std::string name, std::vector<SweepPoint> points, SweepPlots plots)
    : name_(std::move(name)), points_(std::move(points)), plots_(std::move(plots)), observed_(points_.size()) {
  for (std::size_t field = 0; field < points_[0].size(); ++field) {
    const bool alike = std::all_of(points_.begin(), points_.end(),
                                   [&](const SweepPoint& point) { return point[field] == points_[0][field]; });
    if (!alike) varying_.push_back(field);
  }
  choose_response();
  if (!plots_.colour_by.empty())
    colours_.emplace(points_, plots_.colour_by, has_response() ? std::optional(response_field_) : std::nullopt);
}

/// The response field is the one with the most different numbers; that of the colours only if there is no other.
void SweepReport::choose_response() {
  for (const bool of_colours : {false, true}) {
    std::size_t most = 1;
    for (std::size_t field = 0; field < points_[0].size(); ++field) {
      if ((field_of(points_[0][field]) == plots_.colour_by) != of_colours) continue;
      std::set<double> numbers;
      bool all_numbers = true;
      for (const SweepPoint& point : points_) {
        const auto number = number_of(point[field]);
        if (number) numbers.insert(*number);
        all_numbers = all_numbers && number;
      }
      if (all_numbers && numbers.size() > most) {
        most = numbers.size();
        response_field_ = field;
      }
    }
    if (has_response()) return;
  }
}

void SweepReport::add(std::size_t point, std::uint64_t seed, const std::filesystem::path& run) {
  const recorder::Summary summary = recorder::read_summary(run / "summary.json");
  recorder::Reader reader(run / "recording.ktrec");
  const bool groups = colours_ && colours_->by_group();
  const std::vector<recorder::ObservableCurves> observed =
      groups ? recorder::observe_with_groups(reader) : std::vector{recorder::observe(reader)};
  const recorder::ObservableCurves& curves = observed.front();
  std::vector<std::string> own;
  for (const recorder::OwnCurve& curve : curves.own) own.push_back(curve.name);
  if (runs_ == 0) own_ = own;
  if (own != own_) throw RunError(run.string() + ": its observables are not those of the other runs");
  Observed& at = observed_[point];
  at.at_end.resize(observables());
  ++runs_;
  at.sent.add(static_cast<double>(summary.messages.sent));
  at.received.add(static_cast<double>(summary.messages.received));
  at.collided.add(static_cast<double>(summary.messages.collided));
  at.failed.add(summary.robots_failed);
  at.realtime.add(summary.realtime_factor());
  const std::size_t states = curves.time_s.size();
  if (states > at.time_s.size()) at.time_s = curves.time_s;
  if (states > at.over_time.size()) at.over_time.resize(states, Samples(observables()));
  Run& entry = all_runs_.emplace_back(Run{point,
                                          seed,
                                          run.string(),
                                          {},
                                          {},
                                          summary.messages.sent,
                                          summary.messages.received,
                                          summary.messages.collided,
                                          summary.state_hash,
                                          summary.robots_failed});
  for (std::size_t o = 0; o < observables(); ++o) {
    const std::vector<double>& values =
        o < kObservables.size() ? curves.value[o] : curves.own[o - kObservables.size()].value;
    entry.at_end.push_back(values.empty() ? std::nan("") : values.back());
    for (std::size_t i = 0; i < states; ++i) {
      const double value = values[i];
      if (!std::isfinite(value)) continue;
      at.over_time[i][o].add(value);
      if (i + 1 == states) at.at_end[o].add(value);
    }
  }
  if (!colours_) return;
  if (!groups) return colours_->add(point, 0, curve_of(curves));
  for (std::size_t group = 0; group + 1 < observed.size(); ++group)
    colours_->add(point, group, curve_of(observed[group + 1]));
}

ObservedCurve SweepReport::curve_of(const recorder::ObservableCurves& curves) const {
  const std::size_t o = plotted();
  return {curves.time_s, o < kObservables.size() ? curves.value[o] : curves.own[o - kObservables.size()].value};
}

void SweepReport::add_failed(std::size_t point, std::uint64_t seed, const std::filesystem::path& run,
                             const std::string& why) {
  Run& entry = all_runs_.emplace_back();
  entry.point = point;
  entry.seed = seed;
  entry.directory = run.string();
  entry.failure = why;
}

std::size_t SweepReport::runs_with_failed_robots() const {
  return static_cast<std::size_t>(
      std::count_if(all_runs_.begin(), all_runs_.end(), [](const Run& run) { return run.robots_failed > 0; }));
}

std::size_t SweepReport::plotted() const {
  const auto own = std::find(own_.begin(), own_.end(), plots_.own);
  if (own == own_.end()) return static_cast<std::size_t>(plots_.observable);
  return kObservables.size() + static_cast<std::size_t>(own - own_.begin());
}

std::string SweepReport::csv_header(const std::string& first) const {
  std::string text = first;
  for (const recorder::ObservableInfo& o : kObservables)
    text += fmt::format(",{0}{1},{0}_se{1}", o.name, o.column_suffix);
  for (const std::string& own : own_) text += fmt::format(",{0},{0}_se", own);
  return text;
}

std::string SweepReport::fields_header() const {
  std::string text;
  for (const std::string& set : points_[0]) text += "," + csv_cell(field_of(set));
  return text;
}

std::string SweepReport::fields_of(std::size_t point) const {
  std::string text;
  for (const std::string& set : points_[point]) text += "," + csv_cell(set.substr(set.find('=') + 1));
  return text;
}

std::string SweepReport::name_of(std::size_t point) const {
  return points_[point].empty() ? name_ : label(points_[point]);
}

std::string SweepReport::short_name_of(std::size_t point) const {
  if (varying_.size() == 1) {
    const std::string& set = points_[point][varying_[0]];
    return set.substr(set.find('=') + 1);
  }
  SweepPoint fields;
  for (const std::size_t field : varying_) fields.push_back(points_[point][field]);
  return label(fields);
}

std::string SweepReport::constant() const {
  SweepPoint fields;
  for (std::size_t field = 0; field < points_[0].size(); ++field) {
    if (std::find(varying_.begin(), varying_.end(), field) == varying_.end()) fields.push_back(points_[0][field]);
  }
  return label(fields);
}

std::vector<std::vector<std::string>> SweepReport::rows() const {
  std::vector<std::string> header{"at the end", "runs"};
  // Omit observables that no run has.
  std::vector<std::uint8_t> shown(observables(), 0);
  for (std::size_t o = 0; o < observables(); ++o) {
    for (const Observed& at : observed_) {
      if (!at.at_end.empty() && at.at_end[o].count() > 0) shown[o] = 1;
    }
    if (shown[o] == 0) continue;
    if (o >= kObservables.size()) {
      header.push_back(own_[o - kObservables.size()]);
      continue;
    }
    const recorder::ObservableInfo& info = kObservables[o];
    header.push_back(info.unit.empty() ? std::string(info.name) : fmt::format("{}, {}", info.name, info.unit));
  }
  const Samples none(observables());
  const bool messages =
      std::any_of(observed_.begin(), observed_.end(), [](const Observed& at) { return at.sent.mean() > 0; });
  const bool failures =
      std::any_of(observed_.begin(), observed_.end(), [](const Observed& at) { return at.failed.mean() > 0; });
  if (messages) header.insert(header.end(), {"sent", "received"});
  if (failures) header.emplace_back("robots failed");
  header.emplace_back("x real time");
  std::vector<std::vector<std::string>> rows{header};
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Observed& at = observed_[i];
    std::vector<std::string> row{name_of(i), std::to_string(at.realtime.count())};
    for (std::size_t o = 0; o < observables(); ++o) {
      if (shown[o] != 0) row.push_back(with_error((at.at_end.empty() ? none : at.at_end)[o]));
    }
    if (messages) row.insert(row.end(), {with_error(at.sent), with_error(at.received)});
    if (failures) row.push_back(with_error(at.failed));
    row.push_back(fmt::format("{:.0f}", at.realtime.mean()));
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string SweepReport::table() const {
  std::string text = aligned(rows());
  if (const std::vector<Design> ranked = designs(); !ranked.empty())
    text += "\n" + aligned(design_rows(ranked, plotted_name()));
  return text;
}

std::string SweepReport::plotted_name() const {
  return plotted() < kObservables.size() ? std::string(kObservables[plotted()].name) : plots_.own;
}

std::vector<Design> SweepReport::designs() const {
  if (!plots_.largest) return {};
  SweepDesigns designs(points_, *plots_.largest);
  for (const Run& run : all_runs_) {
    if (run.failure.empty()) designs.add(run.point, run.seed, run.at_end[plotted()]);
  }
  return designs.ranked();
}

std::string SweepReport::page(const recorder::Provenance& provenance) const {
  using html::Data;
  const auto object = [](std::initializer_list<std::pair<const char*, std::string>> fields) {
    Data data{Data::type::object};
    for (const auto& [key, value] : fields) data.set(key, value);
    return data;
  };
  std::string tables = html_table(rows());
  if (const std::vector<Design> ranked = designs(); !ranked.empty())
    tables += html_table(design_rows(ranked, plotted_name()));
  Data figures{Data::type::list};
  const auto add = [&](const Plot& plot, const std::string& caption) {
    figures << object({{"image", html::image(plot_svg(plot), caption)}, {"caption", caption}});
  };
  add(curves(), colours_ ? "Over time, a curve per colour" : "Over time, a curve per point");
  if (has_response()) add(response(), "At the end of the runs");
  Data facts{Data::type::list};
  std::string words;
  for (const std::string& word : provenance.command_line) words += (words.empty() ? "" : " ") + word;
  for (const auto& [fact, value] :
       {std::pair<const char*, std::string>{"command line", words},
        {"version", provenance.build},
        {"machine", fmt::format("{}, {} cores", provenance.host, provenance.cores)},
        {"tables", "runs.csv (a row per run), sweep.csv (at the end), curves.csv (over time)"}}) {
    facts << object({{"fact", fact}, {"value", value}});
  }
  Data page = object({{"name", name_}, {"date", provenance.date}, {"runs", runs_text()}, {"table", tables}});
  if (const std::string fields = constant(); !fields.empty()) page.set("constant", fields);
  page.set("figures", figures);
  page.set("facts", facts);
  return html::page("Kilotwin: sweep of " + name_, html::rendered(html::templates::kSweep, page));
}

bool SweepReport::write(const std::filesystem::path& directory, const recorder::Provenance& provenance) const {
  const auto table = [&](const char* name, const std::string& csv) {
    const std::size_t header = csv.find('\n');
    CsvWriter writer(directory / name, csv.substr(0, header));
    writer.rows() += csv.substr(header + 1);
    writer.close();
  };
  table("runs.csv", runs_csv());
  if (runs_ == 0) return false;
  table("sweep.csv", table_csv());
  table("curves.csv", curves_csv());
  if (const std::vector<Design> ranked = designs(); !ranked.empty())
    table("designs.csv", designs_csv(ranked, plotted_name()));
  if (!Gnuplot::installed()) return false;
  write_plot(curves(), directory / "sweep.svg");
  if (has_response()) write_plot(response(), directory / "response.svg");
  os::write_file(directory / "report.html", page(provenance));
  return true;
}

std::string SweepReport::table_csv() const {
  std::string csv = csv_header("point,runs") +
                    ",sent,sent_se,received,received_se,collided,collided_se,robots_failed,realtime_factor" +
                    fields_header() + "\n";
  const Samples none(observables());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Observed& at = observed_[i];
    csv += fmt::format("{},{}", csv_cell(name_of(i)), at.realtime.count());
    for (const Moments& sample : at.at_end.empty() ? none : at.at_end) csv += csv_pair(sample);
    for (const Moments* sample : {&at.sent, &at.received, &at.collided}) csv += csv_pair(*sample);
    csv += fmt::format(",{:.6g},{:.6g}{}\n", at.failed.mean(), at.realtime.mean(), fields_of(i));
  }
  return csv;
}

std::string SweepReport::runs_csv() const {
  std::string csv = "directory,point,seed,well" + fields_header();
  for (const recorder::ObservableInfo& o : kObservables) csv += fmt::format(",{}{}", o.name, o.column_suffix);
  for (const std::string& own : own_) csv += "," + own;
  csv += ",sent,received,collided,robots_failed,state_hash,failure\n";
  std::vector<const Run*> sorted;
  for (const Run& run : all_runs_) sorted.push_back(&run);
  std::sort(sorted.begin(), sorted.end(),
            [](const Run* a, const Run* b) { return std::pair(a->point, a->seed) < std::pair(b->point, b->seed); });
  for (const Run* run : sorted) {
    const bool well = run->failure.empty();
    csv += fmt::format("{},{},{},{}{}", csv_cell(run->directory), run->point, run->seed, well ? 1 : 0,
                       fields_of(run->point));
    for (std::size_t o = 0; o < observables(); ++o) csv += well ? csv_number(run->at_end[o]) : ",";
    if (well) {
      csv += fmt::format(",{},{},{},{},{:016x},\n", run->sent, run->received, run->collided, run->robots_failed,
                         run->state_hash);
    } else {
      csv += ",,,,,," + csv_cell(run->failure) + "\n";
    }
  }
  return csv;
}

std::string SweepReport::curves_csv() const {
  std::string csv = csv_header("point,time_s,runs") + "\n";
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Observed& at = observed_[i];
    const std::string point = csv_cell(name_of(i));
    for (std::size_t k = 0; k < at.over_time.size(); ++k) {
      csv += fmt::format("{},{:.10g},{}", point, at.time_s[k], at.over_time[k][0].count());
      for (const Moments& sample : at.over_time[k]) csv += csv_pair(sample);
      csv += '\n';
    }
  }
  return csv;
}

std::string SweepReport::runs_text() const {
  std::size_t least = observed_[0].realtime.count(), most = least;
  for (const Observed& at : observed_) {
    least = std::min(least, at.realtime.count());
    most = std::max(most, at.realtime.count());
  }
  if (most <= 1) return "one run each";
  return least == most ? fmt::format("{} runs each", most) : fmt::format("{} to {} runs each", least, most);
}

Plot SweepReport::plot() const {
  Plot plot;
  if (plotted() >= kObservables.size()) {
    plot.title = fmt::format("{}: {}", name_, plots_.own);
    plot.y_name = plots_.own;
    return plot;
  }
  const recorder::ObservableInfo& observable = kObservables[plotted()];
  plot.title = fmt::format("{}: {}", name_, observable.title);
  plot.y_name = observable.title;
  if (plots_.observable == recorder::Observable::kMsd) plot.y_name = "MSD";
  plot.y_unit = observable.unit;
  return plot;
}

bool SweepReport::x_logarithmic() const {
  if (plots_.x != AxisScale::kAutomatic) return plots_.x == AxisScale::kLogarithmic;
  std::vector<double> numbers;
  for (const SweepPoint& point : points_) numbers.push_back(*number_of(point[response_field_]));
  return have_equal_ratios(std::move(numbers));
}

Plot SweepReport::curves() const {
  Plot plot = this->plot();
  const bool errors =
      std::any_of(observed_.begin(), observed_.end(), [](const Observed& at) { return at.realtime.count() > 1; });
  plot.subtitle = runs_text() + (errors ? "; shaded: standard error of the mean" : "");
  plot.x_name = "time";
  plot.x_unit = "s";
  plot.y_logarithmic = plots_.y_logarithmic;
  if (varying_.size() == 1) plot.legend_title = field_of(points_[0][varying_[0]]);
  if (const std::string fields = constant(); !fields.empty()) plot.subtitle += "; " + fields;
  if (colours_) {
    colours_->add_curves(plot);
    return plot;
  }
  // If there are too many points, plot an evenly spaced selection that includes the first and the last.
  const std::size_t curves = std::min(points_.size(), kMostCurves);
  if (curves < points_.size()) plot.subtitle += fmt::format("; {} of {} points", curves, points_.size());
  for (std::size_t curve = 0; curve < curves; ++curve) {
    const std::size_t i = curves < 2 ? 0 : curve * (points_.size() - 1) / (curves - 1);
    const Observed& at = observed_[i];
    PlotSeries series;
    series.name = short_name_of(i);
    series.x = at.time_s;
    for (const Samples& samples : at.over_time) {
      const Moments& sample = samples[plotted()];
      series.y.push_back(sample.count() > 0 ? sample.mean() : std::nan(""));
      series.error.push_back(sample.standard_error());
    }
    series.points = false;
    series.band = true;
    plot.series.push_back(std::move(series));
  }
  return plot;
}

Plot SweepReport::response() const {
  Plot plot = this->plot();
  const bool errors =
      std::any_of(observed_.begin(), observed_.end(), [](const Observed& at) { return at.realtime.count() > 1; });
  plot.subtitle = "at the end of the runs, " + runs_text() + (errors ? "; bars: standard error of the mean" : "");
  if (const std::string fields = constant(); !fields.empty()) plot.subtitle += "; " + fields;
  plot.x_name = field_of(points_[0][response_field_]);
  plot.x_logarithmic = x_logarithmic();
  plot.y_logarithmic = plots_.y_logarithmic;
  if (colours_) {
    colours_->add_response(plot);
    return plot;
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Moments sample = observed_[i].at_end.empty() ? Moments() : observed_[i].at_end[plotted()];
    SweepPoint others;
    for (const std::size_t field : varying_) {
      if (field != response_field_) others.push_back(points_[i][field]);
    }
    std::string name = label(others);
    if (others.size() == 1) {
      plot.legend_title = field_of(others[0]);
      name = others[0].substr(others[0].find('=') + 1);
    }
    const auto found = std::find(names.begin(), names.end(), name);
    const auto index = static_cast<std::size_t>(found - names.begin());
    if (found == names.end()) {
      if (names.size() == kMostCurves) continue;
      names.push_back(name);
      plot.series.emplace_back().name = name;
    }
    if (sample.count() == 0) continue;
    plot.series[index].x.push_back(*number_of(points_[i][response_field_]));
    plot.series[index].y.push_back(sample.mean());
    plot.series[index].error.push_back(sample.standard_error());
  }
  return plot;
}

}  // namespace kilotwin::cli
