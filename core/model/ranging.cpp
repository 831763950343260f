#include "core/model/ranging.hpp"

#include "core/base/ir_calibration.h"
#include "core/math/elementary.h"

namespace kilotwin {
namespace {

constexpr std::size_t kMeasured = KILOTWIN_IR_ENTRIES;
constexpr std::array<double, kMeasured> kHigh KILOTWIN_IR_HIGH, kLow KILOTWIN_IR_LOW;
/// Length constant of low(d) in core/base/ir_calibration.h, mm.
constexpr double kDecay_mm = 31.2;

}  // namespace

Ranging::Ranging() {
  static_assert(KILOTWIN_IR_CONTACT_MM == kContact_mm && KILOTWIN_IR_STEP_MM == kStep_mm && kMeasured < kEntries);
  for (std::size_t i = 0; i < high_.size(); ++i) {
    if (i < kMeasured) {
      high_[i] = kHigh[i];
      low_[i] = kLow[i];
    } else {
      const double decay = kt_exp(-kStep_mm * static_cast<double>(i - (kMeasured - 1)) / kDecay_mm);
      high_[i] = kHigh.back() * decay;
      low_[i] = kLow.back() * decay;
    }
  }
}

}  // namespace kilotwin
