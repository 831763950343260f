#ifndef KILOTWIN_CTYPE_H
#define KILOTWIN_CTYPE_H

#ifdef __cplusplus
extern "C" {
#endif

int isdigit(int c);
int isxdigit(int c);
int isupper(int c);
int islower(int c);
int isalpha(int c);
int isalnum(int c);
int isspace(int c);
int isblank(int c);
int iscntrl(int c);
int isprint(int c);
int isgraph(int c);
int ispunct(int c);
int isascii(int c);
int toascii(int c);
int toupper(int c);
int tolower(int c);

#ifdef __cplusplus
}
#endif

#endif
