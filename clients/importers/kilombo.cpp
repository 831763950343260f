// Parameters of Kilombo. docs/how-to/from-kilombo.md lists them.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "clients/importers/imported.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::importers {
namespace {

using Json = nlohmann::ordered_json;

/// Why a parameter has no counterpart; empty: none is reported.
const std::map<std::string, std::string>& reasons_of_parameters() {
  static const std::map<std::string, std::string> all{
      {"timeStep", "a tick is 32.768 ms, the firmware's own"},
      {"GUI", "kilotwin view shows a run in a browser"},
      {"stepsPerFrame", ""},
      {"displayWidth", ""},
      {"displayHeight", ""},
      {"displayWidthPercent", ""},
      {"displayHeightPercent", ""},
      {"displayScale", ""},
      {"displayX", ""},
      {"displayY", ""},
      {"showComms", ""},
      {"showCommsRadius", ""},
      {"showHist", ""},
      {"histLength", ""},
      {"storeHistory", ""},
      {"saveVideo", "kilotwin movie makes one of a recorded run"},
      {"saveVideoN", ""},
      {"imageName", ""},
      {"finalImage", "picture.svg in the run directory"},
      {"stateFileName", "kilotwin export writes tables of a recorded run"},
      {"colorscheme", ""},
      {"speedVariation", "differences of robots are motion.bias_sd_mm_s here; see docs/how-to/from-kilombo.md"},
      {"turnOffsetVariation", "as speedVariation"},
      {"turnSlopeVariation", "as speedVariation"},
      {"useGrid", ""},
      {"gridSize", ""},
      {"pushDisplacement", "robots are solid bodies here"},
      {"maxCollisions", ""},
  };
  return all;
}

/// Up to here a double holds every whole number.
constexpr double kLargestWhole = 0x1p53;

class KilomboImport {
 public:
  KilomboImport(std::string_view text, const std::string& name) : name_(name) {
    try {
      // Kilombo's own files have comments.
      parameters_ = Json::parse(text, nullptr, true, true);
    } catch (const Json::exception& error) {
      throw UserError(fmt::format("{}: is no JSON: {}", name, error.what()));
    }
    if (!parameters_.is_object())
      throw UserError(fmt::format("{}: expected an object, as in {{\"nBots\": 50}}", name));
  }

  Imported result() {
    proto::Experiment& experiment = imported_.experiment;
    if (const auto name = text("botName")) experiment.set_name(*name);
    if (const auto seed = number("randSeed")) {
      if (*seed >= 0)
        experiment.set_seed(whole("randSeed", *seed, kLargestWhole));
      else
        note("randSeed", "was drawn by the clock; --seed chooses one here");
    }
    const double duration_s = number("simulationTime").value_or(0);
    experiment.set_duration_s(duration_s > 0 ? duration_s : 600);
    if (duration_s <= 0) imported_.notes.emplace_back("simulationTime: has no end; 600 s were taken");
    const double robots = number("nBots").value_or(100);
    if (robots < 1) throw UserError(fmt::format("{}: nBots {:g}: expected at least 1", name_, robots));
    layout(static_cast<std::uint32_t>(whole("nBots", robots, std::numeric_limits<std::uint32_t>::max())));
    if (const auto range_mm = number("commsRadius")) experiment.mutable_radio()->set_range_mm(*range_mm);
    if (const auto share = number("msgSuccessRate"); share && *share < 1)
      experiment.mutable_radio()->set_loss(1 - *share);
    if (const auto noise_mm = number("distanceNoise"); noise_mm && *noise_mm > 0) {
      constexpr double kDb_per_mm = 0.139;  // decay of the signal with distance: Propagation.decay_db_per_mm
      experiment.mutable_radio()->set_model(proto::Radio::PROPAGATION);
      experiment.mutable_radio()->mutable_propagation()->set_reading_sd_db(*noise_mm * kDb_per_mm);
    }
    if (const auto speed = number("speed")) experiment.mutable_motion()->set_straight_speed_mm_s(*speed);
    if (const auto rate_deg_s = number("turnRate"))
      experiment.mutable_motion()->set_turn_speed_mm_s(std::round(std::abs(*rate_deg_s) * kPi / 180 * 25 * 1e6) /
                                                       1e6);
    if (const auto steps = number("stateFileSteps"); steps && *steps > 0)
      experiment.mutable_recording()->set_every_s(*steps * number("timeStep").value_or(0.0416667));
    for (const auto& [key, value] : parameters_.items()) {
      const auto reason = reasons_of_parameters().find(key);
      if (read_.contains(key)) continue;
      if (reason == reasons_of_parameters().end())
        imported_.notes.push_back(key + ": is a parameter of the program; give --define, or state it there");
      else if (!reason->second.empty())
        imported_.notes.push_back(key + ": " + reason->second);
    }
    return std::move(imported_);
  }

 private:
  void note(const std::string& key, const std::string& remark) { imported_.notes.push_back(key + ": " + remark); }
  std::optional<double> number(const std::string& key) {
    const auto found = parameters_.find(key);
    if (found == parameters_.end()) return std::nullopt;
    read_[key] = true;
    if (!found->is_number()) throw UserError(fmt::format("{}: \"{}\": {} is no number", name_, key, found->dump()));
    return found->get<double>();
  }
  /// The whole part of a number that is not negative. Throws UserError beyond `most`.
  [[nodiscard]] std::uint64_t whole(const std::string& key, double value, double most) const {
    if (value > most) throw UserError(fmt::format("{}: {} {:g}: expected at most {:.0f}", name_, key, value, most));
    return static_cast<std::uint64_t>(value);
  }
  std::optional<std::string> text(const std::string& key) {
    const auto found = parameters_.find(key);
    if (found == parameters_.end()) return std::nullopt;
    read_[key] = true;
    if (!found->is_string()) throw UserError(fmt::format("{}: \"{}\": {} is no text", name_, key, found->dump()));
    return found->get<std::string>();
  }

  void layout(std::uint32_t robots) {
    proto::RobotGroup& group = *imported_.experiment.add_robots();
    group.set_count(robots);
    group.add_behaviour(imported_.experiment.name().empty() ? "behaviour.c" : imported_.experiment.name() + ".c");
    const std::string formation = text("formation").value_or("random");
    const double share = number("distributePercent").value_or(0.8);
    proto::Layout& layout = *group.mutable_layout();
    // A side that holds the robots with room to move: their discs cover a tenth of it.
    const double side_mm = std::max(600.0, std::ceil(std::sqrt(robots * kPi * 16.5 * 16.5 / 0.1) / 100) * 100);
    imported_.experiment.mutable_arena()->set_width_mm(2 * side_mm);
    imported_.experiment.mutable_arena()->set_height_mm(2 * side_mm);
    imported_.notes.push_back(
        fmt::format("Kilombo's plane has no walls; the arena was taken as {:g} mm square", 2 * side_mm));
    if (formation == "line" || formation == "rline") {
      layout.mutable_grid()->set_pitch_mm(50);
      layout.mutable_grid()->set_columns(robots);
      imported_.experiment.mutable_arena()->set_width_mm(std::max(2 * side_mm, 50.0 * (robots + 2)));
    } else if (formation == "circle" || formation == "ellipse") {
      layout.mutable_rings()->add_count(robots);
      layout.mutable_rings()->add_radius_mm(std::max(60.0, robots * 50 / (2 * kPi)));
      if (formation == "ellipse") note("formation", "\"ellipse\": became a circle");
    } else {
      const bool pile = formation == "pile" || formation == "random_pile";
      const double width_mm =
          pile ? std::sqrt(robots * kPi * 16.5 * 16.5 / 0.35) + 40 : side_mm * std::clamp(share, 0.3, 1.0);
      layout.mutable_random()->set_width_mm(std::round(width_mm));
      layout.mutable_random()->set_height_mm(std::round(width_mm));
      if (!pile && formation != "random")
        note("formation", fmt::format("\"{}\": is not known; became random", formation));
    }
  }

  const std::string name_;
  Json parameters_;
  std::map<std::string, bool> read_;
  Imported imported_;
};

}  // namespace

Imported from_kilombo(std::string_view text, const std::string& name) { return KilomboImport(text, name).result(); }

}  // namespace kilotwin::importers
