/* Infrared ranging curve of a nominal robot: readings of the two amplifiers over the distance d between the rims (disc
 * centres are 33 mm + d apart). In C and C++: the radio engine computes readings from it, robots' programs invert it.
 *
 *   low(d)  = 880 exp(-d / 31.2 mm)
 *   high(d) = min(1000, 1.353 low(d))
 *
 * rounded, at d = 0, 5, .. 65 mm, 10-bit ADC counts. The curve passes through the measured point 713/527 at 49 mm. */
#ifndef KILOTWIN_CORE_BASE_IR_CALIBRATION_H
#define KILOTWIN_CORE_BASE_IR_CALIBRATION_H

#define KILOTWIN_IR_ENTRIES 14
#define KILOTWIN_IR_STEP_MM 5
#define KILOTWIN_IR_CONTACT_MM 33
#define KILOTWIN_IR_LOW \
  { 880, 750, 639, 544, 464, 395, 336, 287, 244, 208, 177, 151, 129, 110 }
#define KILOTWIN_IR_HIGH \
  { 1000, 1000, 864, 736, 627, 534, 455, 388, 330, 281, 240, 204, 174, 148 }

#endif
