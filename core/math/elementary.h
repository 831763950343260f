/* Elementary functions with the same bits on every CPU, compiler and optimisation level. They use + - * / and sqrt only: no
 * libm, no fused multiply-add. They are in C, so that robots' programs link the same code. Requirements: IEEE doubles,
 * rounding to nearest, -ffp-contract=off. With -fno-math-errno, sqrt is an instruction; without, it may be a call with the
 * same result. Special values are those of C, Annex F, but every NaN returned is the positive quiet one,
 * 0x7ff8000000000000. Comments state bounds of the error in units in the last place, which tests/core/math checks. */
#ifndef KILOTWIN_CORE_MATH_ELEMENTARY_H
#define KILOTWIN_CORE_MATH_ELEMENTARY_H

#ifdef __cplusplus
extern "C" {
#endif

double kt_sin(double x);                        /* 0.85 ulp for every finite x: the reduction is exact */
double kt_cos(double x);                        /* 0.85 */
void kt_sincos(double x, double* s, double* c); /* the same bits as kt_sin and kt_cos, at the cost of one */
double kt_tan(double x);                        /* 1.0 */
double kt_atan(double x);                       /* 0.7 */
double kt_atan2(double y, double x);            /* 0.75, in [-pi, pi] */
double kt_asin(double x);                       /* 0.75 */
double kt_acos(double x);                       /* 0.7 */
double kt_exp(double x);                        /* 0.55; 0.8 where the result is subnormal */
double kt_log(double x);                        /* 0.51; -inf at 0, NaN below */
double kt_pow(double x, double y);              /* 0.6; 1.1 where the result is subnormal */
double kt_floor(double x);                      /* exact */
double kt_fmod(double x, double y);             /* exact, sign of x */
double kt_hypot(double x, double y);            /* 1.2 */
double kt_inverse_normal(double p);             /* p in [0, 1]; relative error <= 1e-15, which is up to 6 ulp */

#ifdef __cplusplus
}
#endif
#endif
