#ifndef KILOTWIN_STRING_H
#define KILOTWIN_STRING_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

void* memcpy(void* to, const void* from, size_t size);
void* memmove(void* to, const void* from, size_t size);
void* memset(void* to, int value, size_t size);
int memcmp(const void* a, const void* b, size_t size);
void* memchr(const void* in, int value, size_t size);
void* memccpy(void* to, const void* from, int last, size_t size);
size_t strlen(const char* text);
size_t strnlen(const char* text, size_t most);
int strcmp(const char* a, const char* b);
int strncmp(const char* a, const char* b, size_t most);
int strcasecmp(const char* a, const char* b);
int strncasecmp(const char* a, const char* b, size_t most);
char* strcpy(char* to, const char* from);
char* stpcpy(char* to, const char* from);
char* strncpy(char* to, const char* from, size_t size);
size_t strlcpy(char* to, const char* from, size_t size);
char* strcat(char* to, const char* from);
char* strncat(char* to, const char* from, size_t most);
size_t strlcat(char* to, const char* from, size_t size);
char* strchr(const char* text, int c);
char* strrchr(const char* text, int c);
char* strstr(const char* text, const char* part);
size_t strspn(const char* text, const char* of);
size_t strcspn(const char* text, const char* not_of);
char* strpbrk(const char* text, const char* any_of);
/* Each robot has its own position between two calls. */
char* strtok(char* text, const char* between);
char* strtok_r(char* text, const char* between, char** place);
char* strsep(char** text, const char* between);
char* strdup(const char* text);
char* strlwr(char* text);
char* strupr(char* text);
char* strrev(char* text);
char* strerror(int number);

#ifdef __cplusplus
}
#endif

#endif
