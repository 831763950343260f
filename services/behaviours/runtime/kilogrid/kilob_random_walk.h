/* A random walk: straight, then a turn to either side, in whole seconds. Call kilob_random_walk() in loop(). */
#ifndef KILOTWIN_KILOB_RANDOM_WALK_H
#define KILOTWIN_KILOB_RANDOM_WALK_H

#ifdef __cplusplus
extern "C" {
#endif
/* Means and standard deviations, s. Without this call: 3, 1.5, 1.5, 3. */
void kilob_random_walk_init(double straight_mean_s, double straight_sd_s, double turn_mean_s, double turn_sd_s);
void kilob_random_walk_reset();
void kilob_random_walk();
#ifdef __cplusplus
}
#endif
#endif
