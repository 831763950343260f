// `kilotwin doctor`: finds obstacles to running experiments on this machine, and names remedies.
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "clients/cli/commands.hpp"
#include "core/base/error.hpp"
#include "core/dds/dds.hpp"
#include "core/federation/topics.hpp"
#include "core/os/temporary_folder.hpp"
#include "core/os/worker_pool.hpp"
#include "services/behaviours/compiler.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// The result of a check. A finding with a remedy is a warning, or a failure if it is `fatal`.
struct Finding {
  std::string found, remedy;
  bool fatal = false;
};

Finding check_compiler() {
  try {
    const os::TemporaryFolder scratch("kilotwin-doctor");
    const fs::path source = scratch.path() / "probe.c";
    std::ofstream(source) << "#include <kilolib.h>\nvoid setup(void){}\nvoid loop(void){}\n"
                             "int main(void){kilo_init();kilo_start(setup,loop);return 0;}\n";
    behaviours::CompileOptions options;
    options.cache_directory = scratch.path() / "cache";
    const auto begun = Clock::now();
    static_cast<void>(behaviours::compile({source}, options));
    return {fmt::format("a behaviour compiles in {:.2f} s",
                        std::chrono::duration<double>(Clock::now() - begun).count()),
            ""};
  } catch (const std::exception& error) {
    return {error.what(), "what it says; a C compiler comes with: apt-get install gcc libc6-dev", true};
  }
}

/// Sends a sample through a writer and a reader like those of services.
Finding check_dds(std::optional<std::uint32_t> wanted) {
  try {
    const dds::DomainClaim claim = wanted ? dds::DomainClaim::exactly(*wanted) : dds::DomainClaim::any();
    const auto begun = Clock::now();
    const dds::Participant participant({claim.domain(), {}});
    std::atomic<bool> heard{false};
    const dds::Reader<PublicRunStatus> reader(participant, topics::run_status(),
                                              [&](const PublicRunStatus& sample, dds::SampleState state) {
                                                if (state.valid && sample.run == 1) heard = true;
                                              });
    dds::Writer<PublicRunStatus> writer(participant, topics::run_status());
    PublicRunStatus sample{};
    sample.run = 1;
    writer.write(sample);
    while (!heard && Clock::now() < begun + std::chrono::seconds(3))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (!heard)
      return {"DDS: a sample written on the loopback interface did not come back",
              "check that the interface lo is up: ip link set lo up", true};
    return {fmt::format("DDS works on the loopback interface (domain {} is free)", claim.domain()), ""};
  } catch (const std::exception& error) {
    return {error.what(), "check that the interface lo is up and that no firewall drops UDP on it", true};
  }
}

Finding check_address_space() {
  // Programs are loaded at fixed addresses (services/behaviours/image.hpp).
  constexpr std::uintptr_t kProbe = 0x20000000;
  // NOLINTNEXTLINE(performance-no-int-to-ptr)
  void* const at = mmap(reinterpret_cast<void*>(kProbe), 4096, PROT_NONE,
                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0);
  if (at == MAP_FAILED)
    return {"the addresses at which programs are loaded are taken",
            "run without a preloaded library or unlimited stack (ulimit -s 8192)", true};
  munmap(at, 4096);
  return {"the addresses at which programs are loaded are free", ""};
}

Finding check_receive_buffer() {
  std::ifstream stream("/proc/sys/net/core/rmem_max");
  std::uint64_t bytes = 0;
  if (!(stream >> bytes)) return {"the size of UDP receive buffers is not known here", ""};
  if (bytes < 1'000'000) {
    return {fmt::format("UDP receive buffers hold at most {} KiB: enough for about {} robots in a federated run",
                        bytes / 1024, bytes / 64),
            "for larger swarms: sysctl -w net.core.rmem_max=8388608"};
  }
  return {fmt::format("UDP receive buffers may hold {} KiB", bytes / 1024), ""};
}

Finding check_files() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_cur < 256)
    return {fmt::format("a process may open {} files only", limit.rlim_cur), "ulimit -n 1024"};
  return {fmt::format("a process may open {} files", limit.rlim_cur), ""};
}

Finding check_machine() {
  const std::uint32_t cores = os::cores();
  const double memory_gib =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1u << 30);
  std::error_code error;
  const fs::space_info space = fs::space(".", error);
  const double free_gib = error ? 0 : static_cast<double>(space.available) / (1u << 30);
  Finding finding{fmt::format("{} cores, {:.1f} GiB of memory, {:.1f} GiB free here", cores, memory_gib, free_gib),
                  ""};
  if (!error && free_gib < 0.2) finding.remedy = "make room, or put runs elsewhere with --out";
  return finding;
}

Finding check_avr() {
  for (const char* directory : {"/usr/bin", "/usr/local/bin"}) {
    if (fs::exists(fs::path(directory) / "avr-gcc")) return {"avr-gcc is here: `kilotwin build --avr` works", ""};
  }
  return {"avr-gcc is not here: `kilotwin build --avr` will not work",
          "apt-get install gcc-avr avr-libc binutils-avr"};
}

/// Prints one line per check.
int examine(std::optional<std::uint32_t> domain) {
  const std::function<Finding()> checks[] = {
      check_machine, check_compiler, [&] { return check_dds(domain); }, check_address_space, check_receive_buffer,
      check_files,   check_avr};
  bool healthy = true;
  for (const auto& check : checks) {
    const Finding finding = check();
    const char* const mark = finding.remedy.empty() ? "ok  " : finding.fatal ? "BAD " : "note";
    fmt::print("{} {}{}{}\n", mark, finding.found, finding.remedy.empty() ? "" : "; remedy: ", finding.remedy);
    healthy = healthy && !finding.fatal;
  }
  fmt::print("{}\n", healthy ? "experiments will run here"
                             : "experiments will not run here until the failures above are mended");
  return healthy ? kDone : kFailed;
}

}  // namespace

Command add_doctor(CLI::App& program) {
  const auto domain = std::make_shared<std::optional<std::uint32_t>>();
  CLI::App& app = *program.add_subcommand(
      "doctor", "find what on this machine would keep an experiment from running, and the remedy");
  app.add_option("--domain", *domain, "DDS domain to try (default: a free one)")->type_name("N");
  return {&app, [domain] { return examine(*domain); }};
}

}  // namespace kilotwin::cli
