#ifndef KILOTWIN_SETJMP_H
#define KILOTWIN_SETJMP_H

typedef unsigned long jmp_buf[8];
#ifdef __cplusplus
extern "C" {
#endif
int setjmp(jmp_buf) __attribute__((returns_twice));
void longjmp(jmp_buf, int value) __attribute__((noreturn));
#ifdef __cplusplus
}
#endif

#endif
