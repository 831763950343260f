/// LiveObservables: curves of the observables that an experiment names, of a live run whose directory is not known. They come from
/// the states on the network: poses, LEDs and life cycles. Variables of programs are in the run's recording only.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "clients/recorder/observables.hpp"
#include "clients/recorder/swarm_observables.hpp"
#include "clients/view/curves.hpp"
#include "core/frames/swarm_view.hpp"

namespace kilotwin {
namespace proto {
class Experiment;
}

namespace view {

class LiveObservables {
 public:
  using Clock = std::chrono::steady_clock;

  LiveObservables(const proto::Experiment& experiment, std::uint32_t robots);

  /// A state, and when it came. It is left out if the last one that was taken is too recent: the points are at least 250 ms apart,
  /// and the work takes a tenth of a core at most.
  void take(double time_s, const SwarmView& swarm, Clock::time_point now);
  /// A message of type "plots": an observable that uses variables says so in `absent`.
  [[nodiscard]] std::string list() const { return plots_text(plots_); }
  /// A message of type "plot". Empty: there is no such plot.
  [[nodiscard]] std::string plot(std::uint32_t number) const;

 private:
  void keep_every_second();

  std::vector<PlotEntry> plots_;
  std::vector<std::size_t> own_number_;  ///< per plot without `absent`: its number among the computed ones
  std::unique_ptr<recorder::SwarmObservables> own_;
  recorder::ObservableObserver observer_;
  std::vector<double> time_s_;
  std::vector<std::vector<double>> values_;  ///< per computed observable
  Clock::duration interval_;
  Clock::time_point next_{};
};

}  // namespace view
}  // namespace kilotwin
