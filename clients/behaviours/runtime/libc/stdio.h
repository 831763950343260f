/* Formatting into memory: %d %i %u %x %X %c %s %p %f %% with flags 0 - +, width, precision and h, l, ll. */
#ifndef KILOTWIN_STDIO_H
#define KILOTWIN_STDIO_H

#include <stdarg.h>
#include <stddef.h>

int vsnprintf(char* to, size_t size, const char* format, va_list arguments);
int snprintf(char* to, size_t size, const char* format, ...);
int sprintf(char* to, const char* format, ...);
/* There is no output device: the text is dropped. */
int printf(const char* format, ...);
int puts(const char* text);
int putchar(int c);

#endif
