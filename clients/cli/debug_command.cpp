// `kilotwin debug`: a local run in gdb, which stops where the program of one robot comes by.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "clients/cli/commands.hpp"
#include "clients/cli/local_worker.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/run_arguments.hpp"
#include "core/base/error.hpp"
#include "core/os/descriptor.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "services/behaviours/program_set.hpp"

namespace kilotwin::cli {
namespace {

struct DebugArguments : RunArguments {
  std::uint32_t robot = 0;
  std::string place = "loop";
  double at_s = 0;
  std::vector<std::string> commands;
};

/// Whether the processor stops a process that writes to a watched address. Those of some virtual machines never do.
bool processor_watches() {
  static volatile int watched = 0;
  const pid_t child = fork();
  if (child < 0) return false;
  if (child == 0) {
    // Untraced, it would stop for ever.
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(1);
    raise(SIGSTOP);
    watched = 1;
    _exit(0);
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) return false;
  // Debug register 7: breakpoint 0 is on, for writes of four octets.
  constexpr std::uintptr_t kOnWrites = 0xD0001;
  const auto put = [&](std::size_t number, std::uintptr_t value) {
    const std::size_t at = offsetof(user, u_debugreg) + number * sizeof(value);
    ptrace(PTRACE_POKEUSER, child, at, value);
  };
  put(0, reinterpret_cast<std::uintptr_t>(&watched));
  put(7, kOnWrites);
  ptrace(PTRACE_CONT, child, nullptr, nullptr);
  if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) return false;
  const bool watches = WSTOPSIG(status) == SIGTRAP;
  kill(child, SIGKILL);
  waitpid(child, &status, 0);
  return watches;
}

/// The first commands of gdb: it learns where the robot's program lies in memory, and stops there for this robot alone.
std::string gdb_script(const DebugArguments& arguments, const RunPlan& plan,
                       const recorder::RunDirectory& directory, const behaviours::Program& program) {
  const auto address = program.slot(arguments.robot % behaviours::kSlots).image_address();
  // Robots of a program share its memory in turn, so that a place in the program is passed by several.
  std::string condition = fmt::format("kilo_uid == {}", plan.uid_of(arguments.robot));
  std::string wait;
  if (arguments.at_s > 0) {
    const double ticks = std::floor(arguments.at_s / plan.tick_length.seconds_at(Tick{1}));
    condition += fmt::format(" && kilo_ticks >= {:.0f}", ticks);
    // A program may pass the place thousands of times per tick, and gdb looks at each. The processor itself watches the clock.
    if (processor_watches())
      wait = fmt::format("watch -l kilo_ticks if kilo_ticks >= {:.0f}\ncontinue\ndelete\n", ticks);
    else
      fmt::print(stderr, "kilotwin: this machine has no hardware watchpoints; gdb looks at each pass of {}: slow\n",
                 arguments.place);
  }
  std::string script =
      "set confirm off\n"
      "set pagination off\n"
      "set print thread-events off\n"
      "handle SIGCHLD SIGPIPE nostop noprint pass\n";
  script += fmt::format("add-symbol-file {} -o {:#x}\n", (directory.programs() / (program.sha256 + ".so")).string(),
                        address);
  // A program is named as the experiment names it, from its own folder, or as --behaviour does, from where one stands.
  for (const std::filesystem::path& base : {arguments.experiment.parent_path(), std::filesystem::path()}) {
    const std::filesystem::path file = std::filesystem::absolute(base / program.name).lexically_normal();
    if (std::filesystem::exists(file)) script += fmt::format("directory {}\n", file.parent_path().string());
  }
  script += wait + fmt::format("break {} if {}\n", arguments.place, condition);
  script += fmt::format(
      "echo \\n\\\nRobot {0}, kilo_uid {1}: stops in {2}. Its variables by print NAME; next, step, continue, bt, "
      "quit.\\n\\n\n",
      arguments.robot, plan.uid_of(arguments.robot), arguments.place);
  script += "continue\n";
  for (const std::string& command : arguments.commands) script += command + "\n";
  return script;
}

/// Waits until a debugger holds this process.
void wait_for_debugger() {
  for (;;) {
    const std::optional<std::string> status = os::read_if_there("/proc/self/status");
    if (status && status->find("TracerPid:\t0\n") == std::string::npos) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

/// The run, in a child process that waits for the debugger. Its results are not wanted.
[[noreturn]] void run_for_debugger(const RunPlan& plan, const recorder::RunDirectory& directory, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  wait_for_debugger();
  int status = kDone;
  try {
    run_in_this_process(plan, directory, 1, true, 0);
  } catch (const std::exception& error) {
    fmt::print(stderr, "kilotwin: {}\n", error.what());
    status = kFailed;
  }
  _exit(status);
}

int debug(const DebugArguments& given) {
  DebugArguments arguments = given;
  const std::filesystem::path gdb = os::find_executable("gdb");
  if (gdb.empty()) throw UserError("debug: needs the program gdb; install it: apt-get install gdb");
  arguments.mode = "local";
  const Prepared prepared = prepare(arguments);
  const RunPlan plan(prepared.manifest);
  if (arguments.robot >= plan.robots())
    throw UserError(
        fmt::format("--robot {}: the experiment has robots 0 to {}", arguments.robot, plan.robots() - 1));
  if (plan.program_of(arguments.robot) == kNoProgram)
    throw UserError(fmt::format("--robot {}: runs no program", arguments.robot));
  if (plan.firmware(arguments.robot))
    throw UserError(
        fmt::format("--robot {}: runs firmware on a simulated processor; give a robot that runs natively, or leave "
                    "avr: true out",
                    arguments.robot));
  // The run loads the same programs to the same addresses.
  const auto programs = behaviours::ProgramSet::load(plan, prepared.directory.path());
  const behaviours::Program& program = programs->program(plan.program_of(arguments.robot));
  const std::filesystem::path script = prepared.directory.path() / "debug.gdb";
  os::write_file(script, gdb_script(arguments, plan, prepared.directory, program));

  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw RunError("debug: cannot start a process: " + os::system_reason());
  if (child == 0) run_for_debugger(plan, prepared.directory, parent);
  const std::string process = std::to_string(child);
  std::vector<std::string> words{"gdb", "-q", "-p", process, "-x", script.string()};
  if (!arguments.commands.empty()) words.emplace_back("-batch");
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  // gdb takes the place of this process: it has the terminal, and the run ends with it.
  execv(gdb.c_str(), argv.data());
  const int reason = errno;
  kill(child, SIGKILL);
  throw RunError(fmt::format("{} cannot be started: {}", gdb.string(), std::generic_category().message(reason)));
}

}  // namespace

Command add_debug(CLI::App& program) {
  const auto arguments = std::make_shared<DebugArguments>();
  CLI::App& app = *program.add_subcommand("debug", "run an experiment in gdb; stop in the program of one robot");
  add_experiment_options(app, *arguments);
  add_change_options(app, *arguments);
  app.add_option("--robot", arguments->robot, "the robot, counted from 0")->capture_default_str()->type_name("N");
  app.add_option("--break", arguments->place, "where to stop: a function, or FILE:LINE")
      ->capture_default_str()
      ->type_name("PLACE");
  app.add_option("--at", arguments->at_s, "stop there not before this time of the robot's clock, s")
      ->check(CLI::NonNegativeNumber.description(""))
      ->type_name("SECONDS");
  app.add_option("--command", arguments->commands,
                 "a command of gdb, done at the first stop; then gdb ends. Repeated for more")
      ->allow_extra_args(false)
      ->type_name("TEXT");
  add_output_options(app, arguments->output, "runs/NAME-SEED, with a number added if it exists");
  app.footer("Example: kilotwin debug experiments/disperse.txtpb --robot 3 --at 10");
  return {&app, [arguments] { return debug(*arguments); }};
}

}  // namespace kilotwin::cli
