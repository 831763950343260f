#include "tests/system/program.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

namespace kilotwin::test {

namespace fs = std::filesystem;

Process::Process(const Words& words, const fs::path& scratch) {
  static int counter = 0;
  ++counter;
  out_ = scratch / ("out" + std::to_string(counter));
  err_ = scratch / ("err" + std::to_string(counter));
  std::vector<std::string> copy = words;
  std::vector<char*> argv;
  for (std::string& word : copy) argv.push_back(word.data());
  argv.push_back(nullptr);
  process_ = fork();
  if (process_ == 0) {
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
    dup2(open(out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
    dup2(open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
    if (chdir(scratch.c_str()) != 0) _exit(126);
    execvp(argv[0], argv.data());
    _exit(127);
  }
}

Process::~Process() {
  if (running()) {
    signal(SIGKILL);
    wait();
  }
}

void Process::signal(int number) const { kill(process_, number); }

bool Process::running() {
  if (!ended_ && waitpid(process_, &wait_status_, WNOHANG) == process_) ended_ = true;
  return !ended_;
}

bool Process::says(const std::string& text, double seconds) const {
  const auto has_ended = [this] {
    siginfo_t state{};
    return ended_ || (waitid(P_PID, static_cast<id_t>(process_), &state, WEXITED | WNOHANG | WNOWAIT) == 0 &&
                      state.si_pid != 0);
  };
  const auto has_said = [&] { return read(err_).find(text) != std::string::npos; };
  return eventually([&] { return has_ended() || has_said(); }, seconds) && has_said();
}

Outcome Process::wait(double seconds) {
  if (!eventually([this] { return !running(); }, seconds)) {
    ADD_FAILURE() << "process " << process_ << " did not end within " << seconds << " s";
    signal(SIGKILL);
    waitpid(process_, &wait_status_, 0);
    ended_ = true;
  }
  return {WIFEXITED(wait_status_) ? WEXITSTATUS(wait_status_) : 128 + WTERMSIG(wait_status_), read(out_),
          read(err_)};
}

Scratch::Scratch() {
  std::string pattern = (fs::temp_directory_path() / "kilotwin-test-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no scratch directory");
  path_ = pattern;
}

Scratch::~Scratch() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string program() { return KILOTWIN_PROGRAM; }
std::string source(const std::string& name) { return std::string(KILOTWIN_SOURCES) + "/" + name; }

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

Outcome kilotwin(const Words& words, const Scratch& scratch) {
  Words all{program()};
  all.insert(all.end(), words.begin(), words.end());
  return Process(all, scratch.path()).wait(240);
}

recorder::Summary run(Words words, const Scratch& scratch, const std::string& name) {
  words.insert(words.begin(), "run");
  words.insert(words.end(), {"--quiet", "--out", scratch / name});
  const Outcome outcome = kilotwin(words, scratch);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  if (outcome.status != 0) return {};
  return recorder::read_summary(scratch.path() / name / "summary.json");
}

std::vector<pid_t> processes_with(const std::string& text) {
  std::vector<pid_t> found;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    if (read(entry.path() / "cmdline").find(text) == std::string::npos) continue;
    if (read(entry.path() / "stat").find(") Z ") != std::string::npos) continue;
    const pid_t id = std::stoi(name);
    if (id != getpid()) found.push_back(id);
  }
  return found;
}

void sleep_briefly() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace kilotwin::test
