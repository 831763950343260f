#include "clients/report/gnuplot.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "core/os/temporary_folder.hpp"

namespace kilotwin {
namespace fs = std::filesystem;
namespace {

// Style of all plots: thin frame, print-safe ink, line types with colours that colour-blind readers can
// distinguish.
constexpr const char* kStyle = R"(set encoding utf8
set border 3 lc rgb '#8896a4' lw 1
set tics nomirror out scale 0.6 textcolor rgb '#3b4754'
set grid lc rgb '#e3e8ed' lw 1 lt 1
set key above left Left reverse horizontal samplen 1.6 width 1 textcolor rgb '#3b4754'
set xlabel textcolor rgb '#3b4754' offset 0,0.3
set ylabel textcolor rgb '#3b4754' offset 1,0
set title textcolor rgb '#1f2933'
set linetype 1 lc rgb '#d95f0e' lw 2 pt 7 ps 0.5
set linetype 2 lc rgb '#2563a8' lw 2 pt 7 ps 0.5
set linetype 3 lc rgb '#66727f' lw 1.5 dt (5,4) pt 7 ps 0.4
set linetype 4 lc rgb '#1f2933' lw 1.6
set linetype 5 lc rgb '#d95f0e' lw 1.3 dt (4,3)
set bars small
)";

}  // namespace

std::size_t Gnuplot::add(int width_px, int height_px, std::string commands) {
  plots_.push_back({width_px, height_px, std::move(commands)});
  return plots_.size() - 1;
}

std::string Gnuplot::script(std::size_t plot, const std::string& file) const {
  return fmt::format(
      "reset session\nset terminal svg size {},{} enhanced font 'Helvetica,12' rounded\nset output "
      "'{}'\n{}{}\nunset output\n",
      plots_[plot].width_px, plots_[plot].height_px, file, kStyle, plots_[plot].commands);
}

std::vector<Gnuplot::Drawn> Gnuplot::draw() const {
  if (plots_.empty()) return {};
  const fs::path program = os::find_executable("gnuplot");
  if (program.empty())
    throw RunError("the report's plots need gnuplot, which is not on the PATH; install gnuplot-nox");
  const os::TemporaryFolder scratch("kilotwin-report");
  const auto file = [&](std::size_t k) { return (scratch.path() / fmt::format("{}.svg", k)).string(); };
  const auto run = [&](const std::string& commands) {
    os::write_file(scratch.path() / "plots", commands);
    return os::run_process({program.string(), (scratch.path() / "plots").string()});
  };
  std::string all;
  for (std::size_t k = 0; k < plots_.size(); ++k) all += script(k, file(k));
  std::vector<Drawn> drawn(plots_.size());
  const bool good = run(all).end.well();
  for (std::size_t k = 0; k < plots_.size(); ++k) {
    if (!good) {
      // gnuplot stops at the first plot it cannot draw. The others are then drawn one by one.
      const os::ProcessResult result = run(script(k, file(k)));
      if (!result.end.well()) {
        drawn[k].error = result.errors;
        continue;
      }
    }
    drawn[k].svg = os::read_file(file(k));
  }
  return drawn;
}

bool Gnuplot::installed() { return !os::find_executable("gnuplot").empty(); }

std::string gnuplot_text(std::string_view text) {
  // Within single quotes only the quote itself needs escaping for gnuplot. Enhanced text has markup of its own.
  std::string out = "'";
  for (const char c : text) {
    if (c == '\n' || c == '\r')
      out += ' ';
    else if (c == '\'')
      out += "''";
    else if (c == '_' || c == '^' || c == '@' || c == '&' || c == '~' || c == '{' || c == '}' || c == '\\')
      (out += '\\') += c;
    else
      out += c;
  }
  return out + "'";
}

}  // namespace kilotwin
