/* A robot gets no signals. Handlers are accepted and never called. */
#ifndef KILOTWIN_SIGNAL_H
#define KILOTWIN_SIGNAL_H

#define SIGABRT 6
#define SIGFPE 8
#define SIGSEGV 11
#define SIGINT 2
#define SIGTERM 15
#define SIG_DFL ((void (*)(int))0)
#define SIG_IGN ((void (*)(int))1)
#define signal(number, handler) ((void)(number), (void)(handler), SIG_DFL)

#endif
