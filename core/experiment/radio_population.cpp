#include "core/experiment/radio_population.hpp"

namespace kilotwin {
namespace {

// Values of experiments/models/radio-25-robots.txtpb, to four digits: kilotwin identify fitted them to all measured sets.
constexpr double kRange_mm = 139.2, kOscillatorSd = 0.006884;
/// Cosine and sine of each harmonic of the bearing.
constexpr double kPowerPattern_db[] = {0.02099, -1.477,  1.331,   -0.848,   -0.7795, -0.9839, -1.91,  0.634,
                                       0.6618,  -0.4784, 0.07976, -0.08198, 0.03021, -0.4912, 0.3204, 0.06157};

proto::Propagation measured() {
  proto::Propagation radio;
  radio.set_decay_db_per_mm(0.139);
  radio.set_power_sd_db(0.4424);
  radio.set_sensitivity_sd_db(0.5014);
  radio.set_power_bearing_sd_db(0.4181);
  radio.set_sensitivity_bearing_sd_db(0.4223);
  radio.set_body_loss_db(0.045);
  radio.set_link_sd_db(0.4848);
  radio.set_packet_sd_db(0.06);
  radio.set_pair_sd_db(0.4837);
  radio.set_run_sd_db(0.6224);
  radio.set_notice_db(0.75);
  for (const double entry : kPowerPattern_db) radio.add_power_pattern_db(entry);
  return radio;
}

}  // namespace

void use_measured_radio(proto::Experiment& experiment) {
  if (experiment.radio().model() != proto::Radio::PROPAGATION || experiment.radio().has_propagation()) return;
  proto::Radio& radio = *experiment.mutable_radio();
  *radio.mutable_propagation() = measured();
  if (!radio.has_range_mm()) radio.set_range_mm(kRange_mm);
  if (!radio.has_oscillator_sd()) radio.set_oscillator_sd(kOscillatorSd);
}

}  // namespace kilotwin
