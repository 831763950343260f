/// Runs of the program itself, by `kilotwin sweep`, as a user would make them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/validation/straight_theory.hpp"
#include "tests/validation/verdicts.hpp"

namespace kilotwin::validation {

/// The recording of one run.
struct Recorded {
  std::vector<double> time_s;
  std::vector<std::vector<double>> x_mm, y_mm, heading_rad;     ///< per recorded state: per robot
  std::vector<std::vector<double>> movable_x_mm, movable_y_mm;  ///< per recorded state: per movable body

  [[nodiscard]] std::size_t robots() const { return x_mm.empty() ? 0 : x_mm[0].size(); }
  /// Of robot i, from state `first` on.
  [[nodiscard]] Track track(std::size_t i, std::size_t first) const;
  /// Mean over robots of the squared displacement from state `from` to state `to`, mm^2.
  [[nodiscard]] double msd_mm2(std::size_t from, std::size_t to) const;
  /// The state nearest to a time.
  [[nodiscard]] std::size_t state_at(double time_s) const;
};

/// Runs a program to its end; its words go to `log`. Returns whether its status was 0.
bool run_quietly(std::vector<std::string> words, const std::filesystem::path& log);

class Runs {
 public:
  /// `kilotwin`: the program. Everything goes into a scratch directory that is removed with the object.
  Runs(std::string kilotwin, std::filesystem::path sources);
  ~Runs();
  Runs(const Runs&) = delete;
  Runs& operator=(const Runs&) = delete;

  /// `kilotwin sweep EXPERIMENT WORDS...`, quietly; the runs in the order of points and seeds. Throws RunError where it fails.
  [[nodiscard]] std::vector<Recorded> sweep(const std::string& experiment, const std::vector<std::string>& words);
  /// Whether `kilotwin check` takes the experiment with these words.
  [[nodiscard]] bool accepts(const std::string& experiment, const std::vector<std::string>& words);
  [[nodiscard]] std::filesystem::path source(const std::string& name) const { return sources_ / name; }
  [[nodiscard]] const std::filesystem::path& scratch() const { return scratch_; }

 private:
  bool run(const std::vector<std::string>& words, const std::filesystem::path& log);

  std::string kilotwin_;
  std::filesystem::path sources_, scratch_;
  int sweeps_ = 0;
};

/// Mean over runs with its standard error.
[[nodiscard]] Figure mean_of(const std::vector<double>& values);

}  // namespace kilotwin::validation
