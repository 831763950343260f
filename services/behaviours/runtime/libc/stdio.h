/* Formatted output as in avr-libc. Standard output and standard error go to the robot's log (docs/reference/programs.md). A stream
 * that the program defines also calls its function. Robots have no files, so fopen() returns NULL. */
#ifndef KILOTWIN_STDIO_H
#define KILOTWIN_STDIO_H

#include <stdarg.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct kilotwin_file {
  int (*put)(char, struct kilotwin_file*);
  int (*get)(struct kilotwin_file*);
  unsigned char flags;
  void* udata;
} FILE;

extern FILE *stdin, *stdout, *stderr;
#define stdin stdin
#define stdout stdout
#define stderr stderr

#define EOF (-1)
#define BUFSIZ 64
#define SEEK_SET 0
#define SEEK_CUR 1
#define SEEK_END 2

/* Streams that a program defines. */
#define _FDEV_EOF (-2)
#define _FDEV_ERR (-1)
#define _FDEV_SETUP_READ 1
#define _FDEV_SETUP_WRITE 2
#define _FDEV_SETUP_RW 3
#define FDEV_SETUP_STREAM(put, get, flags) \
  { put, get, flags, 0 }
#define fdev_setup_stream(stream, p, g, f) \
  do {                                     \
    (stream)->put = p;                     \
    (stream)->get = g;                     \
    (stream)->flags = f;                   \
    (stream)->udata = 0;                   \
  } while (0)
#define fdev_set_udata(stream, u) ((stream)->udata = (u))
#define fdev_get_udata(stream) ((stream)->udata)
#define fdev_close() ((void)0)
FILE* fdevopen(int (*put)(char, FILE*), int (*get)(FILE*));

int printf(const char* format, ...) __attribute__((format(printf, 1, 2)));
int vprintf(const char* format, va_list arguments);
int fprintf(FILE* stream, const char* format, ...) __attribute__((format(printf, 2, 3)));
int vfprintf(FILE* stream, const char* format, va_list arguments);
int sprintf(char* to, const char* format, ...) __attribute__((format(printf, 2, 3)));
int vsprintf(char* to, const char* format, va_list arguments);
int snprintf(char* to, size_t size, const char* format, ...) __attribute__((format(printf, 3, 4)));
int vsnprintf(char* to, size_t size, const char* format, va_list arguments);
int puts(const char* text);
int putchar(int c);
int fputs(const char* text, FILE* stream);
int fputc(int c, FILE* stream);
int putc(int c, FILE* stream);
size_t fwrite(const void* from, size_t size, size_t count, FILE* stream);
int fflush(FILE* stream);
void perror(const char* text);
#define printf_P printf
#define fprintf_P fprintf
#define sprintf_P sprintf
#define snprintf_P snprintf
#define puts_P puts
#define fputs_P fputs

int sscanf(const char* text, const char* format, ...) __attribute__((format(scanf, 2, 3)));
int vsscanf(const char* text, const char* format, va_list arguments);
#define sscanf_P sscanf

/* Functions for input, which always fail. */
FILE* fopen(const char* name, const char* mode);
int fclose(FILE* stream);
int scanf(const char* format, ...);
int fscanf(FILE* stream, const char* format, ...);
char* fgets(char* to, int size, FILE* stream);
int fgetc(FILE* stream);
int getc(FILE* stream);
int getchar(void);
size_t fread(void* to, size_t size, size_t count, FILE* stream);
int fseek(FILE* stream, long offset, int from);
long ftell(FILE* stream);
void rewind(FILE* stream);
int remove(const char* name);
int feof(FILE* stream);
int ferror(FILE* stream);
void clearerr(FILE* stream);

#ifdef __cplusplus
}
#endif

#endif
