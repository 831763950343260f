/* Delays under POSIX names, for programs that were written on a host. */
#ifndef KILOTWIN_UNISTD_H
#define KILOTWIN_UNISTD_H

#ifdef __cplusplus
extern "C" {
#endif
unsigned sleep(unsigned seconds);
int usleep(unsigned long microseconds);
#ifdef __cplusplus
}
#endif

#endif
