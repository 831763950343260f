/// When octets that a writer has handed over are through on a serial line: one after the other, none faster than the line.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>

#include "clients/ohc/serial_packet.hpp"

namespace kilotwin::ohc {

/// Times are s on any clock that does not go back.
class LineClock {
 public:
  struct Octet {
    std::uint8_t value;
    double at_s;  ///< its stop bit is over
  };

  /// The writer hands over octets at `now_s`.
  void put(std::span<const std::uint8_t> octets, double now_s) {
    if (waiting_.empty()) free_s_ = std::max(free_s_, now_s);
    waiting_.insert(waiting_.end(), octets.begin(), octets.end());
  }
  /// The next octet that is through at `now_s`.
  std::optional<Octet> take(double now_s) {
    if (waiting_.empty() || free_s_ + kOctet_s > now_s) return std::nullopt;
    free_s_ += kOctet_s;
    const Octet octet{waiting_.front(), free_s_};
    waiting_.pop_front();
    return octet;
  }
  [[nodiscard]] bool idle() const { return waiting_.empty(); }
  /// When everything handed over is through.
  [[nodiscard]] double done_s() const { return free_s_ + static_cast<double>(waiting_.size()) * kOctet_s; }

 private:
  static constexpr double kOctet_s = 1.0 / kOctetsPerSecond;

  std::deque<std::uint8_t> waiting_;
  double free_s_ = 0;  ///< the line is busy until then
};

}  // namespace kilotwin::ohc
