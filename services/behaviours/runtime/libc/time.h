/* A robot has no date. time() counts the seconds of its clock since its start. */
#ifndef KILOTWIN_TIME_H
#define KILOTWIN_TIME_H

#include <stddef.h>

#define CLOCKS_PER_SEC 31

/* As wide as the program's unsigned long, to which it may hand pointers: 32 bits with the robot's int, else 64. */
#ifdef KILOTWIN_ROBOT_INT
typedef unsigned int time_t;
typedef unsigned int clock_t;
#define KILOTWIN_TIME "time"
#else
typedef unsigned long time_t;
typedef unsigned long clock_t;
#define KILOTWIN_TIME "kilotwin_wide_time"
#endif

#ifdef __cplusplus
extern "C" {
#endif
time_t time(time_t* seconds) __asm__(KILOTWIN_TIME);
clock_t clock(void);
static inline double difftime(time_t later, time_t earlier) { return (double)later - (double)earlier; }
#ifdef __cplusplus
}
#endif

#endif
