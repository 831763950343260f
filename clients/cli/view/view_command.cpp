// `kilotwin-view view`: a web page of a recorded run, of the runs on a domain, or of one run that is live and then recorded.
#include "clients/cli/view_command.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include "clients/foxglove/server/live_topics.hpp"
#include "clients/view/live_run.hpp"
#include "clients/view/recorded_run.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

using namespace std::chrono_literals;

struct ViewArguments {
  std::filesystem::path run;
  std::optional<std::uint32_t> domain;
  dds::Transport transport;
  std::optional<std::uint16_t> port;
  bool foxglove = false;
  http::Endpoint endpoint;           ///< without the port
  std::vector<std::string> origins;  ///< of viewers, with --foxglove

  [[nodiscard]] http::Endpoint endpoint_or(std::uint16_t usual_port) const {
    http::Endpoint at = endpoint;
    at.port = port.value_or(usual_port);
    return at;
  }
};

/// How often a recording is looked at for new states.
constexpr auto kLook = 200ms;
/// Beside a run that uses all cores, the run goes first. A recording may be that of a run that goes on.
constexpr int kNiceness = 10;

class Viewing {
 public:
  explicit Viewing(const ViewArguments& arguments) : arguments_(arguments) {
    if (arguments.domain) {
      dds::Transport transport = arguments.transport;
      transport.domain = *arguments.domain;
      // Where `kilotwin run` started this process, lines about its own run would disturb its progress.
      live_ = std::make_unique<view::LiveRun>(transport, arguments.run, /*tells=*/arguments.run.empty());
    } else {
      recorded_ = std::make_unique<view::RecordedRun>(arguments.run);
    }
    view::PageFiles page = view::PageFiles::of_this_program();
    if (!page.built())
      warn("kilotwin: the page was not built, its address says how; building it needs scripts/setup");
    gateway_ = std::make_unique<view::Gateway>(arguments.endpoint_or(0), view::random_token(), std::move(page));
    say("kilotwin: open " + gateway_->address());
    if (recorded_) show_recording();
  }

  int work() {
    while (interrupted() == 0) {
      if (live_) {
        live_->serve(*gateway_);
        if (live_->ended_run() != 0 && !arguments_.run.empty()) go_over_to_recording();
      } else {
        std::this_thread::sleep_for(kLook);
        if (const std::string extent = recorded_->grown(); !extent.empty()) gateway_->post_status(extent);
      }
    }
    return kDone;
  }

 private:
  void show_recording() {
    gateway_->show(*recorded_, recorded_->text());
    say(fmt::format("kilotwin: shows the recording of {}: {} robots, {} states; Ctrl-C ends",
                    one_line(recorded_->name(), 128), recorded_->robots(), recorded_->states()));
  }

  void go_over_to_recording() {
    recorded_ = std::make_unique<view::RecordedRun>(arguments_.run);
    gateway_->show(*recorded_, recorded_->text());
    live_.reset();
  }

  const ViewArguments& arguments_;
  std::unique_ptr<view::LiveRun> live_;
  std::unique_ptr<view::RecordedRun> recorded_;
  std::unique_ptr<view::Gateway> gateway_;  // ends before what answers for it
};

int serve_foxglove(const ViewArguments& arguments) {
  if (!arguments.domain)
    throw UserError(
        "view: --foxglove shows live runs; give --domain N. For a recorded one: kilotwin export RUN --mcap FILE");
  dds::Transport transport = arguments.transport;
  transport.domain = *arguments.domain;
  foxglove::Server server(arguments.endpoint_or(foxglove::kUsualPort), arguments.origins);
  say(fmt::format("kilotwin: open {}://{}:{} in Foxglove or Lichtblick, as a Foxglove WebSocket; Ctrl-C ends",
                  arguments.endpoint.encrypted() ? "wss" : "ws", arguments.endpoint.host, server.port()));
  foxglove::LiveTopics live(transport, server);
  while (interrupted() == 0) live.serve();
  return kDone;
}

int show(const ViewArguments& arguments) {
  if (arguments.run.empty() && !arguments.domain)
    throw UserError("view: give RUN, the directory of a run, or --domain N, the domain of a live one");
  if (!arguments.origins.empty() && !arguments.foxglove)
    throw UserError("view: --origin admits pages of viewers; give --foxglove, or leave it out");
  arguments.endpoint.check();
  catch_interrupts();
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNiceness));
  return arguments.foxglove ? serve_foxglove(arguments) : Viewing(arguments).work();
}

}  // namespace

Command add_view(CLI::App& program) {
  const auto arguments = std::make_shared<ViewArguments>();
  CLI::App& app = *program.add_subcommand("view", "a web page of a recorded or live run");
  app.add_option("RUN", arguments->run, "directory of a run, which may still be going on, or its recording")
      ->type_name("");
  app.add_option("--domain", arguments->domain,
                 "DDS domain of live runs; with RUN, its recording adds curves, variables and logs, and is shown "
                 "once the run "
                 "has ended")
      ->check(CLI::Range(0u, dds::kLastDomain).description(""))
      ->type_name("N");
  app.add_option(
         "--peer", arguments->transport.peers,
         "address of a machine of the run; give each of them, this machine too (default: all on this machine)")
      ->allow_extra_args(false)
      ->type_name("ADDRESS");
  app.add_option("--port", arguments->port,
                 "port for the page (default: one that is free; with --foxglove 8765); 0: one that is free")
      ->type_name("P");
  app.add_option(
         "--listen", arguments->endpoint.host,
         "IPv4 address or name of this machine, as it stands in the page's address; other machines need TLS: "
         "--certificate and --key")
      ->capture_default_str()
      ->type_name("ADDRESS");
  app.add_option("--certificate", arguments->endpoint.certificate, "serve with TLS: PEM file of the certificate")
      ->type_name("FILE");
  app.add_option("--key", arguments->endpoint.key, "PEM file of its private key")->type_name("FILE");
  app.add_flag("--foxglove", arguments->foxglove,
               "serve live runs by the Foxglove WebSocket protocol in place of the page");
  app.add_option("--origin", arguments->origins,
                 "with --foxglove: a further origin whose pages may connect, such as https://viewer.example")
      ->allow_extra_args(false)
      ->type_name("ORIGIN");
  app.footer(
      "Example: kilotwin view runs/disperse-1. Open the address that it prints. The token in it allows to steer a "
      "live run.");
  return {&app, [arguments] { return show(*arguments); }};
}

}  // namespace kilotwin::cli
