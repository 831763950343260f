// Writes a set of test data for `kilotwin identify`: OUT/train and OUT/test in the contract's form, truth.json
// with the true values, and oracle.csv with the oracle's predictions.
// Usage: kilotwin_truth SCENE|nothing:SEED|random:SEED|list [--seed N] [--out DIR] [--samples N]
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <string>

#include "tests/identify/truth/files.hpp"
#include "tests/identify/truth/oracle.hpp"
#include "tests/identify/truth/play.hpp"
#include "tests/identify/truth/scenarios.hpp"

namespace {

using namespace kilotwin::truth;

constexpr double kHorizon_s = 10;

std::vector<Prediction> predictions(const Scene& scene, const Play& played, int samples) {
  std::vector<Prediction> all;
  for (const Run& run : played.test) {
    const std::vector<Prediction> of_run =
        predict(scene, played.individuals, run, kHorizon_s, samples, played.seed + 1);
    all.insert(all.end(), of_run.begin(), of_run.end());
  }
  return all;
}

int usage() {
  fmt::print(
      stderr,
      "usage: kilotwin_truth SCENE|nothing:SEED|random:SEED|list [--seed N] [--out DIR] [--samples N]; scenes:");
  for (const std::string& name : scenario_names()) fmt::print(stderr, " {}", name);
  fmt::print(stderr, "\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  std::string name, directory;
  unsigned long long seed = 1;
  int samples = 100;
  try {
    for (int i = 1; i < argc; ++i) {
      const std::string option = argv[i];
      if (option.rfind("--", 0) != 0) {
        if (!name.empty()) return usage();
        name = option;
      } else if (i + 1 == argc) {
        return usage();
      } else if (option == "--seed") {
        seed = std::stoull(argv[++i]);
      } else if (option == "--out") {
        directory = argv[++i];
      } else if (option == "--samples") {
        samples = std::stoi(argv[++i]);
      } else {
        return usage();
      }
    }
    if (name == "list") {
      for (const std::string& scene : scenario_names()) fmt::print("{:20} {}\n", scene, scenario(scene).about);
      return 0;
    }
    if (name.empty()) return usage();
    // The seed in the name of a set is also that of its play.
    if (const std::size_t colon = name.find(':'); colon != std::string::npos)
      seed = std::stoull(name.substr(colon + 1));
    const Scene scene = scenario(name);
    if (directory.empty()) directory = scene.name;
    const Play played = play(scene, seed);
    write_data(scene, played.train, directory + "/train");
    write_data(scene, played.test, directory + "/test");
    const std::vector<Prediction> knows = predictions(scene, played, samples);
    Scene without = scene;
    without.effects.clear();
    const double blind = scene.effects.empty() ? rmse_mm(knows) : rmse_mm(predictions(without, played, samples));
    write_predictions(knows, directory + "/oracle.csv");
    write_truth(scene, played, rmse_mm(knows), blind, directory + "/truth.json");
    fmt::print("{}: oracle {:.2f} mm, without its effects {:.2f} mm\n", directory, rmse_mm(knows), blind);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "kilotwin_truth: {}\n", error.what());
    return 1;
  }
}
