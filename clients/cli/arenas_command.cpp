// `kilotwin arenas`: arenas that another program steps, by requests on standard input. docs/reference/arenas.md has the protocol.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>

#include "clients/arenas/batch.hpp"
#include "clients/cli/commands.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/run_arguments.hpp"
#include "core/base/error.hpp"
#include "core/os/temporary_folder.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::cli {
namespace {

using arenas::Batch;
using nlohmann::ordered_json;

constexpr std::uint32_t kMostArenas = 4096;

struct ArenasArguments {
  RunArguments run;
  std::uint32_t count = 1, threads = 0;
  std::vector<std::string> variables;
};

/// The experiment with the variables recorded, whatever else it records.
LoadedExperiment loaded_of(const ArenasArguments& arguments) {
  LoadedExperiment loaded = load_with_overrides(arguments.run);
  proto::Recording& recording = *loaded.experiment.mutable_recording();
  for (const std::string& name : arguments.variables) recording.add_variable()->set_name(name);
  return loaded;
}

ordered_json description_of(const Batch& batch, const std::vector<std::uint64_t>& seeds) {
  ordered_json arrays = ordered_json::object();
  for (const arenas::ArrayLayout& array : batch.arrays().layout())
    arrays[array.name] = {{"type", array.type}, {"shape", array.shape}, {"offset", array.offset}};
  return {{"arenas", batch.count()},
          {"robots", batch.plan().robots()},
          {"seeds", seeds},
          {"tick_s", batch.plan().tick_length.seconds()},
          {"last_tick", batch.plan().last_tick.count()},
          {"variables", batch.variables()},
          {"memory", fmt::format("/proc/{}/fd/{}", getpid(), batch.arrays().descriptor())},
          {"octets", batch.arrays().octets()},
          {"arrays", std::move(arrays)}};
}

/// Requests of one program to one batch.
class Requests {
 public:
  explicit Requests(Batch& batch) : batch_(batch) {}

  /// The answer to a request. Throws UserError, RunError, and nlohmann's exceptions where the request is not as it should be.
  ordered_json answer(const ordered_json& request) {
    if (!request.is_object() || request.size() != 1)
      throw UserError("a request is a JSON object with one member: step, reset, send, place, set or failures");
    const std::string& what = request.begin().key();
    const ordered_json& with = request.begin().value();
    if (what == "step") return step(with);
    if (what == "reset") return reset(with);
    if (what == "send") return send(with);
    if (what == "place") return place(with);
    if (what == "set") return set(with);
    if (what == "failures") return failures();
    throw UserError(
        fmt::format("there is no request {}; there are step, reset, send, place, set and failures", what));
  }

 private:
  ordered_json step(const ordered_json& ticks) {
    if (!ticks.is_number_unsigned()) throw UserError("step: give a number of ticks");
    batch_.step(ticks.get<std::int64_t>());
    return ordered_json::object();
  }

  ordered_json reset(const ordered_json& pairs) {
    std::vector<std::pair<std::uint32_t, std::uint64_t>> seeds;
    for (const ordered_json& pair : pairs) {
      if (!pair.is_array() || pair.size() != 2 || !pair[1].is_number_unsigned())
        throw UserError("reset: give a list of pairs, each of an arena and its seed");
      seeds.emplace_back(arena_of(pair[0]), pair[1].get<std::uint64_t>());
    }
    batch_.reset(seeds);
    return ordered_json::object();
  }

  ordered_json send(const ordered_json& message) {
    OverheadPacket packet;
    packet.command = message.value("once", false) ? OverheadCommand::kOnce : OverheadCommand::kRepeat;
    const ordered_json& data = message.at("data");
    constexpr std::size_t kData = 9;
    if (!data.is_array() || data.size() > kData) throw UserError("send: data has at most 9 octets");
    for (std::size_t i = 0; i < data.size(); ++i) packet.message.at(i) = octet_of(data[i]);
    packet.message.at(kData) = octet_of(message.at("type"));
    batch_.send(arenas_of(message), packet);
    return ordered_json::object();
  }

  ordered_json place(const ordered_json& where) {
    const bool movable = where.contains("movable");
    const ordered_json& body = where.at(movable ? "movable" : "robot");
    if (!body.is_number_unsigned() || body.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
      throw UserError(fmt::format("place: {} is no number of a robot or a movable body", body.dump()));
    const Pose pose{where.at("x_mm").get<double>(), where.at("y_mm").get<double>(),
                    where.value("heading_rad", 0.0)};
    batch_.place(arenas_of(where), {movable, body.get<std::uint32_t>(), pose});
    return ordered_json::object();
  }

  ordered_json set(const ordered_json& index) {
    if (!index.is_number_unsigned() || index.get<std::size_t>() >= batch_.variables().size())
      throw UserError("set: give the index of a variable");
    batch_.set_variable(index.get<std::size_t>());
    return ordered_json::object();
  }

  ordered_json failures() const {
    ordered_json list = ordered_json::array();
    for (std::uint32_t i = 0; i < batch_.count(); ++i) {
      for (const auto& failure : batch_.arena(i).failures())
        list.push_back({{"arena", i}, {"robot", failure.robot}, {"text", failure.text}});
    }
    return {{"failures", std::move(list)}};
  }

  /// The arenas that a request names, else all.
  std::vector<std::uint32_t> arenas_of(const ordered_json& request) const {
    std::vector<std::uint32_t> arenas;
    if (request.contains("arenas")) {
      for (const ordered_json& arena : request.at("arenas")) arenas.push_back(arena_of(arena));
      return arenas;
    }
    arenas.resize(batch_.count());
    std::iota(arenas.begin(), arenas.end(), 0);
    return arenas;
  }
  std::uint32_t arena_of(const ordered_json& value) const {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= batch_.count())
      throw UserError(fmt::format("there is no arena {}; there are 0 to {}", value.dump(), batch_.count() - 1));
    return value.get<std::uint32_t>();
  }
  static std::uint8_t octet_of(const ordered_json& value) {
    constexpr std::uint64_t kMost = 255;
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMost)
      throw UserError(fmt::format("send: {} is no octet, 0 to 255", value.dump()));
    return value.get<std::uint8_t>();
  }

  Batch& batch_;
};

void say_line(const ordered_json& line) {
  std::cout << line.dump(-1, ' ', false, ordered_json::error_handler_t::replace) << std::endl;
}

ordered_json answer_of(Requests& requests, const std::string& line) {
  try {
    return requests.answer(ordered_json::parse(line));
  } catch (const UserError& error) {
    return {{"error", error.what()}, {"status", 2}};
  } catch (const RunError& error) {
    return {{"error", error.what()}, {"status", 1}};
  } catch (const ordered_json::exception& error) {
    return {{"error", fmt::format("the request is not as it should be: {}", error.what())}, {"status", 2}};
  }
}

int serve(ArenasArguments& arguments) {
  arguments.run.mode = "local";
  LoadedExperiment loaded = loaded_of(arguments);
  const Resolved resolved = resolve(loaded, arguments.run, Notes::kPrinted);
  const os::TemporaryFolder folder("kilotwin-arenas");
  const auto directory = recorder::RunDirectory::create(folder.path());
  write_programs(loaded, resolved, directory);
  const auto plan_of = [&](std::uint64_t seed) {
    if (seed == resolved.manifest.experiment().seed()) return std::make_shared<const RunPlan>(resolved.manifest);
    loaded.experiment.set_seed(seed);
    return std::make_shared<const RunPlan>(resolve(loaded, arguments.run, Notes::kSilent).manifest);
  };
  std::vector<std::uint64_t> seeds(arguments.count);
  std::iota(seeds.begin(), seeds.end(), resolved.manifest.experiment().seed());
  Batch batch(plan_of, directory.path(), seeds, arguments.threads == 0 ? os::cores() : arguments.threads);
  say_line(description_of(batch, seeds));
  Requests requests(batch);
  for (std::string line; std::getline(std::cin, line);) say_line(answer_of(requests, line));
  return 0;
}

}  // namespace

Command add_arenas(CLI::App& program) {
  const auto arguments = std::make_shared<ArenasArguments>();
  CLI::App& parser =
      *program.add_subcommand("arenas", "arenas that another program steps, for optimisers and learning");
  add_experiment_options(parser, arguments->run);
  add_change_options(parser, arguments->run);
  parser.add_option("--count", arguments->count, "number of arenas; their seeds ascend from the experiment's")
      ->check(CLI::Range(1u, kMostArenas))
      ->type_name("N")
      ->capture_default_str();
  parser.add_option("--threads", arguments->threads, "threads (default: all cores)")->type_name("N");
  parser
      .add_option("--variable", arguments->variables,
                  "variable of the programs that is shown and can be set; repeat it")
      ->allow_extra_args(false)
      ->type_name("NAME");
  parser.footer(
      "Requests are lines of JSON on standard input, answers are lines on standard output, and states lie in "
      "shared memory: "
      "docs/reference/arenas.md. The Python package does this for you: kilotwin.Arenas.");
  return {&parser, [arguments] { return serve(*arguments); }};
}

}  // namespace kilotwin::cli
