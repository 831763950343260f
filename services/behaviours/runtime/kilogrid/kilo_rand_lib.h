/* Random numbers for robots on a Kilogrid. */
#ifndef KILOTWIN_KILO_RAND_LIB_H
#define KILOTWIN_KILO_RAND_LIB_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

/* A normally distributed time in whole seconds, in ticks: mean and standard deviation in seconds. */
#define INT_GAUSSIAN_TICKS(mean_s, sd_s) (uint32_t)(floor(abs(g_ran_gaussian(mean_s, sd_s))) * TICKS_PER_SEC)

#ifdef __cplusplus
extern "C" {
#endif
/* 0: a seed by rand_hard(). */
void g_ran_set_seed_uint32(uint32_t seed);
double g_ran_uniform(); /* [0, 1] */
uint32_t g_ran_uniform_uint32();
double g_ran_exponential(double rate);
double g_ran_gaussian(double mean, double sd);
#ifdef __cplusplus
}
#endif
#endif
