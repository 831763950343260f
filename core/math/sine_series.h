/* Constants of sine and cosine, for elementary.c and for vector code that computes the same bits. derive_constants.py prints
 * them. */
#ifndef KILOTWIN_CORE_MATH_SINE_SERIES_H
#define KILOTWIN_CORE_MATH_SINE_SERIES_H

/* (sin r - r) / r^3 and (cos r - 1 + r^2/2) / r^4 in powers of r^2, |r| <= pi/4. */
static const double kSine[7] = {-0x1.5555555555555p-3, 0x1.111111111111p-7,    -0x1.a01a01a019926p-13,
                                0x1.71de3a545e7p-19,   -0x1.ae64540f0ba18p-26, 0x1.61217c1864fa1p-33,
                                -0x1.ab161757f0c63p-41};
static const double kCosine[6] = {0x1.5555555555555p-5,   -0x1.6c16c16c1696p-10, 0x1.a01a019f4d0edp-16,
                                  -0x1.27e4fa15bd814p-22, 0x1.1eeb66b683028p-29, -0x1.907c0e63adbb6p-37};

static const double kTwoOverPiRounded = 0x1.45f306dc9c883p-1;

/* pi/2 in parts of 33, 33 and 53 bits. The products of the first two with an integer below 2^20 are exact. */
static const double kHalfPi1 = 0x1.921fb544p+0, kHalfPi2 = 0x1.0b4611a6p-34, kHalfPi3 = 0x1.3198a2e037073p-69;

/* Adding and then subtracting it rounds |x| < 2^51 to the nearest integer: the ulp is 1 in [2^52, 2^53). */
static const double kWholeNumbers = 0x1.8p52;

#endif
