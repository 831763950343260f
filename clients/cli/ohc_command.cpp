// `kilotwin ohc`: an overhead controller for a run, in software or a physical one.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "clients/cli/commands.hpp"
#include "clients/ohc/real_controller.hpp"
#include "clients/ohc/virtual_controller.hpp"
#include "core/base/error.hpp"
#include "core/dds/dds.hpp"

namespace kilotwin::cli {
namespace {

struct OhcArguments {
  std::filesystem::path link, device;
  std::uint32_t domain = 0;
};

int work(const OhcArguments& arguments) {
  if (arguments.link.empty() && arguments.device.empty())
    throw UserError("ohc: no port; give --pty LINK for a virtual controller, or --serial DEVICE for a real one");
  if (!arguments.link.empty())
    ohc::run_virtual_controller(arguments.link, arguments.domain);
  else
    ohc::run_real_controller(arguments.device, arguments.domain);
  return kDone;
}

}  // namespace

Command add_ohc(CLI::App& program) {
  const auto arguments = std::make_shared<OhcArguments>();
  CLI::App& app =
      *program.add_subcommand("ohc", "an overhead controller: a virtual one for station programs, or a real one");
  CLI::Option* const pty =
      app.add_option(
             "--pty", arguments->link,
             "make a pseudo-terminal and this link to it; a station program that opens it as its serial port "
             "commands the robots of the run")
          ->type_name("LINK");
  app.add_option("--serial", arguments->device,
                 "serial port of a physical controller, which then sends what the run's station sends")
      ->excludes(pty)
      ->type_name("DEVICE");
  app.add_option("--domain", arguments->domain, "DDS domain of the run (default: 0)")
      ->check(CLI::Range(0u, dds::kLastDomain).description(""))
      ->type_name("N");
  app.footer("Example: kilotwin ohc --pty /tmp/ttyUSB0 --domain 7");
  return {&app, [arguments] { return work(*arguments); }};
}

}  // namespace kilotwin::cli
