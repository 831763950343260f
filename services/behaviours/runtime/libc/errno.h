#ifndef KILOTWIN_ERRNO_H
#define KILOTWIN_ERRNO_H

#define EDOM 33
#define ERANGE 34
#ifdef __cplusplus
extern "C" {
#endif
extern int errno;
#ifdef __cplusplus
}
#endif

#endif
