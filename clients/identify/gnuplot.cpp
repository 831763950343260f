#include "clients/identify/gnuplot.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <filesystem>

#include "clients/behaviours/process.hpp"
#include "clients/recorder/file.hpp"
#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace fs = std::filesystem;
namespace {

class Scratch {
 public:
  Scratch() {
    std::string pattern = (fs::temp_directory_path() / "kilotwin-report-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw RunError("no scratch directory can be made for plots");
    path_ = pattern;
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// What all plots share: a plain frame, ink that prints, colours that colour-blind eyes tell apart (line types by number).
constexpr const char* kStyle = R"(set encoding utf8
set border 3 lc rgb '#8896a4' lw 1
set tics nomirror out scale 0.6 textcolor rgb '#3b4754'
set grid lc rgb '#e3e8ed' lw 1 lt 1
set key top right samplen 1.6 spacing 1.15 textcolor rgb '#3b4754'
set xlabel textcolor rgb '#3b4754' offset 0,0.3
set ylabel textcolor rgb '#3b4754' offset 1,0
set title textcolor rgb '#1f2933'
set linetype 1 lc rgb '#d95f0e' lw 2 pt 7 ps 0.5
set linetype 2 lc rgb '#2563a8' lw 2 pt 7 ps 0.5
set linetype 3 lc rgb '#66727f' lw 1.5 dt (5,4) pt 7 ps 0.4
set linetype 4 lc rgb '#1f2933' lw 1.6
set style fill solid 0.25 noborder
set bars small
)";

}  // namespace

std::size_t Gnuplot::add(int width_px, int height_px, std::string commands) {
  plots_.push_back({width_px, height_px, std::move(commands)});
  return plots_.size() - 1;
}

std::vector<std::string> Gnuplot::draw() const {
  if (plots_.empty()) return {};
  const fs::path program = behaviours::find_executable("gnuplot");
  if (program.empty())
    throw RunError("the report's plots need gnuplot, which is not on the PATH; install gnuplot-nox");
  const Scratch scratch;
  std::string script;
  for (std::size_t k = 0; k < plots_.size(); ++k) {
    script += fmt::format(
        "reset session\nset terminal svg size {},{} enhanced font 'Helvetica,12' fontscale 1 rounded\nset output "
        "'{}/{}.svg'\n",
        plots_[k].width_px, plots_[k].height_px, scratch.path().string(), k);
    script += kStyle;
    script += plots_[k].commands;
    script += "\nunset output\n";
  }
  recorder::write_file(scratch.path() / "plots", script);
  const behaviours::ProcessResult result =
      behaviours::run_process({program.string(), (scratch.path() / "plots").string()});
  if (result.status != 0) {
    throw RunError(fmt::format("gnuplot failed with status {}: {}", result.status, result.errors.substr(0, 300)));
  }
  std::vector<std::string> drawn;
  for (std::size_t k = 0; k < plots_.size(); ++k)
    drawn.push_back(recorder::read_file(scratch.path() / fmt::format("{}.svg", k)));
  return drawn;
}

std::string gnuplot_text(std::string_view text) {
  // Single quotes take everything but themselves as it is; enhanced text has a markup of its own.
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

}  // namespace kilotwin::identify
