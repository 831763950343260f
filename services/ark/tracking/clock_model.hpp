/// How the clock of a tracker runs against the station's: offset and drift from one-way delays, without any exchange.
///
/// A sample that the source wrote at s by its clock arrives at a by the station's; a - s = offset(s) + delay, and the delay
/// is never below its least value. The model keeps the least a - s of every second for two minutes. Its line is the one
/// below all of these points that lies nearest to them: the edge of their lower convex hull over the middle of the window
/// (a linear programme; S. B. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay
/// measurements, INFOCOM 1999). The least delay itself cannot be told from the offset and stays in every stamp.
///
/// Pure: it reads no clock. Its memory is bounded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace kilotwin::ark {

class ClockModel {
 public:
  /// For so long after its first sample, or after a restart, the drift is taken for 0, s.
  static constexpr double kWarmUp_s = 10;
  /// TAI less UTC since 2017, s: cameras that take their time from PTP may show TAI.
  static constexpr double kTaiLead_s = 37;

  struct Sample {
    std::uint64_t frame = 0;
    std::int64_t capture_ns = 0, sent_ns = 0;  ///< by the source's clock; sent_ns 0: not known
    bool shows_utc = false;                    ///< the source says so
    std::int64_t arrival_ns = 0;               ///< by the station's steady clock
    std::int64_t arrival_utc_ns = 0;           ///< by the station's UTC
  };
  /// Instants by the station's steady clock; neither is later than the arrival.
  struct Stamp {
    std::int64_t capture_ns = 0;
    std::int64_t sent_ns = 0;  ///< the capture's where it is not known
    bool offered = false;      ///< by the source's UTC, else by the model
  };

  /// Nothing: the sample repeats an old frame, or its time contradicts all others.
  std::optional<Stamp> take(const Sample& sample);

  [[nodiscard]] bool warm() const;
  /// Station's time less source's, the least delay included, at the last sample, ns.
  [[nodiscard]] std::int64_t offset_ns() const;
  /// How much slower the source's clock is than the station's, parts per million.
  [[nodiscard]] double drift_ppm() const { return slope_ * 1e6; }
  /// Number of restarts of the source or of changes to its clock.
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }
  /// Samples that were not used because of their time.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// UTC of the source less the station's as of the last sample that said that it shows UTC but could not, s; 0: none did.
  [[nodiscard]] double wrong_utc_s() const { return wrong_utc_s_; }

 private:
  /// The least a - s within a second: x_s since base_ns_, d_ns over first_ns_.
  struct Point {
    double x_s, d_ns;
  };

  void start(std::int64_t source_ns, std::int64_t arrival_ns);
  [[nodiscard]] bool is_step(double d_ns, bool is_usable);
  void add(double x_s, double d_ns);
  void fit();
  [[nodiscard]] double line_ns(double x_s) const { return at_.d_ns + slope_ * 1e9 * (x_s - at_.x_s); }

  bool any_ = false;
  std::uint64_t last_frame_ = 0;
  std::int64_t last_source_ns_ = 0;
  std::int64_t base_ns_ = 0;   ///< source's time of the first sample
  std::int64_t first_ns_ = 0;  ///< its a - s
  std::deque<Point> points_;
  Point at_{0, 0};    ///< a point of the line
  double slope_ = 0;  ///< s per s
  std::uint32_t suspects_ = 0;
  double suspect_ns_ = 0;  ///< a - s of the last sample that contradicted the line
  std::uint32_t restarts_ = 0;
  std::uint64_t refused_ = 0;
  double wrong_utc_s_ = 0;
};

}  // namespace kilotwin::ark
