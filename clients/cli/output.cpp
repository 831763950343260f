#include "clients/cli/output.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

bool lies_in(const fs::path& input, const fs::path& directory) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(input, error), place = fs::weakly_canonical(directory, error);
  return std::mismatch(place.begin(), place.end(), whole.begin(), whole.end()).first == place.end();
}

}  // namespace

void add_output_options(CLI::App& app, Output& output, const std::string& fallback) {
  app.add_option("--out", output.out, "directory to write to, new or empty (default: " + fallback + ")")
      ->type_name("DIR");
  app.add_flag("--force", output.force, "replace the directory where it exists");
}

recorder::RunDirectory make_output(const Output& output, const fs::path& fallback,
                                   const std::vector<fs::path>& inputs) {
  using Existing = recorder::RunDirectory::Existing;
  const fs::path wanted = output.out.empty() ? fallback : output.out;
  if (!output.force)
    return recorder::RunDirectory::create(wanted, output.out.empty() ? Existing::kNumber : Existing::kRefuse);
  for (const fs::path& input : inputs) {
    if (!input.empty() && lies_in(input, wanted)) {
      throw UserError(fmt::format("{}: --force would remove {}, which this command reads; give another --out",
                                  wanted.string(), input.string()));
    }
  }
  return recorder::RunDirectory::create(wanted, Existing::kReplace);
}

fs::path make_plain_output(const Output& output, const fs::path& fallback, const std::vector<fs::path>& inputs) {
  const recorder::RunDirectory directory = make_output(output, fallback, inputs);
  std::error_code ignored;
  fs::remove(directory.programs(), ignored);
  return directory.path();
}

std::string place_in_words(const fs::path& used, const Output& output, const fs::path& fallback) {
  if (!output.out.empty() || used == fallback) return used.string();
  return fmt::format("{} ({} holds an earlier result; --force replaces it)", used.string(), fallback.string());
}

void warn_beyond_cores(const std::string& option, std::uint32_t count) {
  const std::uint32_t cores = os::cores();
  if (count <= cores) return;
  warn(fmt::format("kilotwin: {} {}: this process may use {} cores; more than {} only take turns, which is slower",
                   option, count, cores, cores));
}

}  // namespace kilotwin::cli
