/* Elementary functions whose last bit is the same on every CPU, compiler and optimisation level: only + - * / and sqrt,
 * no libm, no fused multiply-add. Errors against the exact value are at most 2 units in the last place over the stated
 * range (measured by tests/core/math). C, so that robots' programs link the very same code. */
#ifndef KILOTWIN_CORE_MATH_ELEMENTARY_H
#define KILOTWIN_CORE_MATH_ELEMENTARY_H

#ifdef __cplusplus
extern "C" {
#endif

double kt_sin(double x);                 /* any finite x; reduction is exact to 2 ulp for |x| <= 1e6 */
double kt_cos(double x);
void kt_sincos(double x, double* s, double* c);
double kt_tan(double x);
double kt_atan(double x);
double kt_atan2(double y, double x);     /* in [-pi, pi]; the usual signs at zeros */
double kt_asin(double x);
double kt_acos(double x);
double kt_exp(double x);
double kt_log(double x);                 /* x > 0; -inf at 0, NaN below */
double kt_pow(double x, double y);
double kt_floor(double x);
double kt_fmod(double x, double y);      /* exact, sign of x */
double kt_hypot(double x, double y);
double kt_inverse_normal(double p);      /* p in (0, 1); relative error <= 1e-15 */

#ifdef __cplusplus
}
#endif
#endif
