#include "tests/validation/runs.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "clients/recorder/reader.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/stats/moments.hpp"

namespace kilotwin::validation {

namespace fs = std::filesystem;

Track Recorded::track(std::size_t i, std::size_t first) const {
  Track track;
  for (std::size_t k = first; k < time_s.size(); ++k) {
    track.time_s.push_back(time_s[k]);
    track.x_mm.push_back(x_mm[k][i]);
    track.y_mm.push_back(y_mm[k][i]);
    track.heading_rad.push_back(heading_rad[k][i]);
  }
  return track;
}

double Recorded::msd_mm2(std::size_t from, std::size_t to) const {
  double sum = 0;
  for (std::size_t i = 0; i < robots(); ++i) {
    const double dx = x_mm[to][i] - x_mm[from][i], dy = y_mm[to][i] - y_mm[from][i];
    sum += dx * dx + dy * dy;
  }
  return sum / static_cast<double>(robots());
}

std::size_t Recorded::state_at(double at_s) const {
  std::size_t best = 0;
  for (std::size_t k = 0; k < time_s.size(); ++k) {
    if (std::abs(time_s[k] - at_s) < std::abs(time_s[best] - at_s)) best = k;
  }
  return best;
}

Runs::Runs(std::string kilotwin, fs::path sources) : kilotwin_(std::move(kilotwin)), sources_(std::move(sources)) {
  std::string pattern = (fs::temp_directory_path() / "kilotwin-validation-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw RunError("no scratch directory can be made");
  scratch_ = pattern;
}

Runs::~Runs() {
  std::error_code ignored;
  fs::remove_all(scratch_, ignored);
}

bool run_quietly(std::vector<std::string> words, const fs::path& log) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t process = fork();
  if (process == 0) {
    dup2(open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
    dup2(STDOUT_FILENO, STDERR_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  return process >= 0 && waitpid(process, &status, 0) == process && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool Runs::run(const std::vector<std::string>& words, const fs::path& log) {
  std::vector<std::string> all{kilotwin_};
  all.insert(all.end(), words.begin(), words.end());
  return run_quietly(std::move(all), log);
}

bool Runs::accepts(const std::string& experiment, const std::vector<std::string>& words) {
  std::vector<std::string> all{"check", experiment};
  all.insert(all.end(), words.begin(), words.end());
  return run(all, scratch_ / "check.log");
}

std::vector<Recorded> Runs::sweep(const std::string& experiment, const std::vector<std::string>& words) {
  const fs::path out = scratch_ / fmt::format("sweep-{}", ++sweeps_), log = out.string() + ".log";
  std::vector<std::string> all{"sweep", experiment, "--out", out.string()};
  all.insert(all.end(), words.begin(), words.end());
  if (!run(all, log))
    throw RunError(fmt::format("kilotwin sweep {} failed; it said: {}", experiment, os::read_file(log)));
  std::vector<std::pair<std::pair<std::string, std::uint64_t>, fs::path>> found;  // by point, then seed
  for (const fs::directory_entry& entry : fs::directory_iterator(out)) {
    if (!fs::exists(entry.path() / "summary.json")) continue;
    const std::string name = entry.path().filename().string();
    found.push_back({{name.substr(0, name.find('-')), std::stoull(name.substr(name.find('-') + 1))}, entry.path()});
  }
  std::sort(found.begin(), found.end());
  std::vector<Recorded> runs;
  for (const auto& [key, directory] : found) {
    recorder::Reader reader(directory / "recording.ktrec");
    Recorded& run = runs.emplace_back();
    while (const proto::StateRecord* state = reader.next_state()) {
      run.time_s.push_back(reader.tick_length().seconds_at(Tick{state->tick()}));
      run.x_mm.emplace_back(state->x_mm().begin(), state->x_mm().end());
      run.y_mm.emplace_back(state->y_mm().begin(), state->y_mm().end());
      run.heading_rad.emplace_back(state->heading_rad().begin(), state->heading_rad().end());
      run.movable_x_mm.emplace_back(state->movable_x_mm().begin(), state->movable_x_mm().end());
      run.movable_y_mm.emplace_back(state->movable_y_mm().begin(), state->movable_y_mm().end());
    }
  }
  fs::remove_all(out);
  return runs;
}

Figure mean_of(const std::vector<double>& values) {
  stats::Moments sample;
  for (const double value : values) sample.add(value);
  return {sample.mean(), sample.standard_error()};
}

}  // namespace kilotwin::validation
