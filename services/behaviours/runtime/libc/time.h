/* A robot has no date. time() counts the seconds of its clock since its start. */
#ifndef KILOTWIN_TIME_H
#define KILOTWIN_TIME_H

#include <stddef.h>

#define CLOCKS_PER_SEC 31

typedef long time_t;
typedef long clock_t;

#ifdef __cplusplus
extern "C" {
#endif
time_t time(time_t* seconds);
clock_t clock(void);
double difftime(time_t later, time_t earlier);
#ifdef __cplusplus
}
#endif

#endif
