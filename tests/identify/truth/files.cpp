#include "tests/identify/truth/files.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace kilotwin::truth {
namespace {

using nlohmann::ordered_json;

void write(const std::filesystem::path& file, const std::string& text) {
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

const char* word(Motion motion) {
  constexpr const char* kWords[] = {"stop", "straight", "left", "right"};
  return kWords[static_cast<int>(motion)];
}

const char* word(Fault::Kind kind) {
  constexpr const char* kWords[] = {"swapped", "clock", "duplicate", "outliers", "frozen"};
  return kWords[static_cast<int>(kind)];
}

}  // namespace

void write_data(const Scene& scene, const std::vector<Run>& runs, const std::filesystem::path& directory) {
  std::string tracks = scene.heading ? "run,robot,time_s,x_mm,y_mm,heading_rad\n" : "run,robot,time_s,x_mm,y_mm\n";
  std::string orders = "run,robot,time_s,motion\n";
  for (const Run& run : runs) {
    for (const Sample& s : run.samples) {
      tracks += fmt::format("{},{},{:.3f},{:.3f},{:.3f}", s.run, s.robot, s.time_s, s.point.x, s.point.y);
      if (scene.heading) tracks += fmt::format(",{:.4f}", s.heading_rad);
      tracks += '\n';
    }
    for (std::size_t robot = 0; robot < run.orders.size(); ++robot) {
      for (const Order& order : run.orders[robot]) {
        orders += fmt::format("{},{},{:.3f},{}\n", run.number, robot, order.time_s + scene.commands_late_s,
                              word(order.motion));
      }
    }
  }
  write(directory / "trajectories.csv", tracks);
  write(directory / "commands.csv", orders);
}

void write_truth(const Scene& scene, const Play& play, double oracle_rmse_mm, double blind_rmse_mm,
                 const std::filesystem::path& file) {
  ordered_json out = {{"name", scene.name},
                      {"about", scene.about},
                      {"seed", play.seed},
                      {"oracle_rmse_mm", oracle_rmse_mm},
                      {"blind_rmse_mm", blind_rmse_mm}};
  out["effects"] = ordered_json::array();
  for (const Effect& e : scene.effects) {
    out["effects"].push_back(
        {{"name", e.name}, {"formula", e.formula}, {"named_by", e.named_by}, {"mistaken_for", e.mistaken_for}});
  }
  out["faults"] = ordered_json::array();
  for (const Fault& f : scene.faults) {
    out["faults"].push_back({{"kind", word(f.kind)},
                             {"run", f.run},
                             {"robot", f.robot},
                             {"other", f.other},
                             {"from_s", f.from_s},
                             {"until_s", f.until_s},
                             {"amount", f.amount}});
  }
  out["drive"] = {{"wheel_base_mm", scene.wheel_base_mm},
                  {"disc_ahead_mm", scene.disc_ahead_mm},
                  {"tracked_ahead_mm", scene.tracked_ahead_mm},
                  {"factor_sd", scene.factor_sd},
                  {"step_s", scene.step_s},
                  {"factor_variance_s", scene.factor_sd * scene.factor_sd * scene.step_s}};
  out["tracker"] = {{"sd_mm", scene.tracker_sd_mm},
                    {"heading", scene.heading},
                    {"heading_sd_rad", scene.heading_sd_rad},
                    {"coarse", scene.coarse},
                    {"commands_late_s", scene.commands_late_s}};
  out["room"] = {{"width_mm", scene.width_mm}, {"height_mm", scene.height_mm}, {"contacts", scene.contacts}};
  out["bias_mm_s"] = ordered_json::array();
  for (const Individual& i : play.individuals) out["bias_mm_s"].push_back({i.bias_mm_s.left, i.bias_mm_s.right});
  write(file, out.dump(1) + "\n");
}

void write_predictions(const std::vector<Prediction>& predictions, const std::filesystem::path& file) {
  std::string text = "run,robot,time_s,x_mm,y_mm,truth_x_mm,truth_y_mm\n";
  for (const Prediction& p : predictions) {
    text += fmt::format("{},{},{:.0f},{:.4f},{:.4f},{:.4f},{:.4f}\n", p.run, p.robot, p.time_s, p.predicted.x,
                        p.predicted.y, p.truth.x, p.truth.y);
  }
  write(file, text);
}

}  // namespace kilotwin::truth
