#include "clients/recorder/provenance.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/base/build_identity.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {

using Json = nlohmann::ordered_json;

namespace {

std::vector<std::string> words_of_this_process() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  return words;
}

}  // namespace

Provenance provenance_of_this_process() {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  return {KILOTWIN_VERSION,
          std::string(build_identity()),
          fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now)),
          words_of_this_process(),
          host,
          std::thread::hardware_concurrency()};
}

void write_provenance(const Provenance& p, const std::filesystem::path& file) {
  const Json json{{"version", p.version},           {"build", p.build}, {"date", p.date},
                  {"command_line", p.command_line}, {"host", p.host},   {"cores", p.cores}};
  os::write_file(file, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::optional<Provenance> read_provenance(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return std::nullopt;
  try {
    const Json json = Json::parse(os::read_file(file));
    Provenance p;
    json.at("version").get_to(p.version);
    json.at("build").get_to(p.build);
    json.at("date").get_to(p.date);
    json.at("command_line").get_to(p.command_line);
    json.at("host").get_to(p.host);
    json.at("cores").get_to(p.cores);
    return p;
  } catch (const Json::exception& error) {
    throw UserError(
        fmt::format("{}: is not the provenance.json of a run directory ({})", file.string(), error.what()));
  }
}

}  // namespace kilotwin::recorder
